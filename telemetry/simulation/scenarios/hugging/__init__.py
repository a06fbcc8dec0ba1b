"""Terrain hugging among things that the surface model knows nothing of."""
