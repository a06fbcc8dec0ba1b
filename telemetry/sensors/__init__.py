"""Real sensors and what they leave behind: streams from their ports, their configurations, their raw files."""
