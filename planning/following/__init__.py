"""How a flown track compares with the line that was planned: where along it, how far beside and above, how late."""
