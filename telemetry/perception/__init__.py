"""Perception on the bus: sensor frames and poses in, maps, regions and alerts out; and maps from recordings."""
