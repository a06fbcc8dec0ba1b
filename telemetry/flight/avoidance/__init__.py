"""Avoidance in flight, sans-IO: stop, climb or step aside, and let go again."""
