"""Before a flight: what was read back, where the vehicle stands, what it sees, and where to go on."""
