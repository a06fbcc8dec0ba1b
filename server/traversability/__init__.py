"""Where ground can be driven on or landed on: worked out in workers, kept for the open surface model, shown over it."""
