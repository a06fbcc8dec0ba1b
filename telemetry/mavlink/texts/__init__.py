"""What a vehicle says: STATUSTEXT and events, put together, in order, in words."""

from telemetry.mavlink.texts.speech import HeardWords, Speech
from telemetry.mavlink.texts.status_texts import Texts, VehicleWords

__all__ = ["HeardWords", "Speech", "Texts", "VehicleWords"]
