"""How likely a flight is to touch the ground, by many flights with random errors: an estimate, never a proof."""
