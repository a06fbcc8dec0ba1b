"""Moving objects: radar frames and poses in; tracks, what they forbid the vehicle to do, and approach alerts out."""
