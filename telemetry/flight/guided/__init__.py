"""The navigation script in GUIDED: targets handed over one at a time (Melita 2020, section 7)."""
