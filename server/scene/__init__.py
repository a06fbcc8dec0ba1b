"""The 3D view: what is drawn of plan, flight and maps, and the cameras of the pages; nothing of it computes a plan."""
