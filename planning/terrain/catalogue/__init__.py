"""Several surface models as one: the best at each place, and the worse of what they say where one ends."""
