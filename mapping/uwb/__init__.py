"""UWB radar against foliage: which untraversable cells of a traversability map are soft vegetation (Ahtiainen)."""
