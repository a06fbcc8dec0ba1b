"""``hedgehop account`` and ``hedgehop tls``: who may come in, and how other devices know this station."""
