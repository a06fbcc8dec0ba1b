"""``hedgehop radar``: raw radar files."""
