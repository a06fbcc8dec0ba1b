"""Ways past obstacles that were seen: over, around, aside of what moves, and the velocities that lead into nothing."""
