"""Surface models: what a catalogue of them holds, and models made of point clouds."""
