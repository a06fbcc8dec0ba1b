"""Surface models: what a catalogue of them holds, models made of point clouds, and models dilated."""
