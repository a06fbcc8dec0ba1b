"""Infineon's Position2Go (BGT24MTR12, 24 GHz) on its USB serial port, asked for raw samples frame by frame."""
