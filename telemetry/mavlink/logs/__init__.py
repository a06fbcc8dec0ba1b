"""Logs that lie on the vehicle: which there are, and their bytes; sans-IO."""
