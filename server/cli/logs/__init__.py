"""``hedgehop logs``: the logs that lie on the vehicle."""
