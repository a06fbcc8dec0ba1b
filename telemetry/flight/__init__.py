"""Flying a plan: the navigation script, checks before the start, resuming."""
