"""Recordings of other stations: listed when they are asked for, and fetched in pieces, behind everything that flies."""
