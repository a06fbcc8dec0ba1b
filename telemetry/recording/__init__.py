"""Flights on disk: writing them while they happen, reading them afterwards, playing them again."""
