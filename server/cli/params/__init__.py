"""``hedgehop params``: the vehicle's parameters."""
