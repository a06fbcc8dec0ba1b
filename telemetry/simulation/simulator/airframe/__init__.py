"""The simulated airframe: how it moves, what moves it, and how wrong its instruments are."""
