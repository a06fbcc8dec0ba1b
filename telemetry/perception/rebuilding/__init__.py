"""Maps made again from recordings, and maps as files for other programs."""
