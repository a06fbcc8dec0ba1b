"""What a vehicle says: STATUSTEXT and events, put together, in order, in words."""

from telemetry.mavlink.texts.speech import Heard, Speech
from telemetry.mavlink.texts.status_texts import Texts, VehicleWords

__all__ = ["Heard", "Speech", "Texts", "VehicleWords"]
