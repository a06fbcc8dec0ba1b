"""``hedgehop library``: recordings, plans, models and photos of several machines, by way of a folder or a store."""
