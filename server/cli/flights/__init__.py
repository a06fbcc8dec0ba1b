"""``hedgehop fly`` and ``hedgehop goto``: what has a vehicle fly."""
