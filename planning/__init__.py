"""The planning floor: surface model to safe surface, path, timing, mission and certificate. Imports only `mapping`."""

__version__ = "0.1.0"
