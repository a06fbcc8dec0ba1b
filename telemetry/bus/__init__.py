"""The bus between Hedgehop's processes on one machine: publish, subscribe and call, over Unix sockets, no open port."""

from telemetry.bus.bus import Bus
from telemetry.bus.encoding import error_info, error_of
from telemetry.bus.subscription import Subscription

__all__ = ["Bus", "Subscription", "error_info", "error_of"]
