"""What comes over the bus from vehicles, links, agents and recorders, and how it is asked and passed on."""
