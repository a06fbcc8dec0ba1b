"""``hedgehop fly``, ``hedgehop goto`` and ``hedgehop home``: what has a vehicle fly, and where it returns to."""
