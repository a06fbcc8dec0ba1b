"""A guided command as a small certified line: up, over and down, around a point, or back the way that was flown."""
