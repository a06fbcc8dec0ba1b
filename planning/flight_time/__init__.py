"""How long a mission will take: legs and corners as the autopilots fly them."""
