"""Several vehicles held apart: in the air, and before a start."""
