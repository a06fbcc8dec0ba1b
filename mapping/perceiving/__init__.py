"""Perception without sockets or clocks: sensor frames and poses in, map, regions, obstacles and alerts out."""
