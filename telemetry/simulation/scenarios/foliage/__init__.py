"""A UWB radar clears foliage from a map of where to drive (Ahtiainen)."""
