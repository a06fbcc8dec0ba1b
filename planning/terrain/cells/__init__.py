"""A raster's own cells as they lie in a model's reference system, and the north-up squares that stand for them."""
