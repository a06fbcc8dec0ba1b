"""What travels on the bus: plain frozen dataclasses, known to both ends."""
