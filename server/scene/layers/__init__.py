"""The layers of the 3D view: what each draws."""
