"""From points or an area to a timed path over the safe surface."""
