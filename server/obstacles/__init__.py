"""Obstacles: what the sensors' nodes have seen is kept, drawn, told to the pages, and what may be done about it."""
