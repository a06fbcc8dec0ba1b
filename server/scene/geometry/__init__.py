"""From arrays of the workers to what can be drawn: frames, meshes, shapes, colours."""
