"""The bus between Hedgehop's processes on one machine: publish, subscribe and call, over Unix sockets, no open port."""

from telemetry.bus.bus import Bus

__all__ = ["Bus"]
