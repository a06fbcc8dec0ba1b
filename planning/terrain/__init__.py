"""The surface model: reading it, its datum, its holes and spikes, and how it is shown."""

SMALL_HOLE_M2 = 4.0
"""Holes below it are taken for gaps of the survey."""
BOUND_RMS = 3.0
"""An accuracy is told as RMS of the check points; three times that bounds 99.7 % of normally distributed errors."""
