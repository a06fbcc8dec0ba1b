"""FMCW radar, from samples to targets: range and Doppler FFT, CFAR, direction of arrival (Miccinesi 2022, fig. 7)."""
