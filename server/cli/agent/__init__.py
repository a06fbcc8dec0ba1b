"""``hedgehop agent``: a companion computer's sensors."""
