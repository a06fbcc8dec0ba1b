"""Frames, attitudes and poses: how a measurement gets to where it belongs, and arithmetic in metres."""
