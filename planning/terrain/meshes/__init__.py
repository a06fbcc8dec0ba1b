"""Textured meshes of photogrammetry, to be looked at: decoded in the confined child, laid on a surface model."""
