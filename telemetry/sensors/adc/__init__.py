"""Raw samples of FMCW radars from files: NumPy arrays, DCA1000 captures, the ODA data set (docs/radar-files.md)."""
