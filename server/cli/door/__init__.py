"""``hedgehop account``, ``tls`` and ``stations``: who may come in, and how others know this station."""
