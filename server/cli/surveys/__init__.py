"""``hedgehop survey``: flights over an area, alone or in parts."""
