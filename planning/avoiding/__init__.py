"""The parts of ``planning.avoidance``: how near lines come to what was seen, and the search for ways past it."""
