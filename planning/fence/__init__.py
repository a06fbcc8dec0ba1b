"""Where a vehicle may be: fences and rally points, and whether a flight keeps inside them."""
