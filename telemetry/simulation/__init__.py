"""A simulated vehicle, and the papers' field tests flown with it."""
