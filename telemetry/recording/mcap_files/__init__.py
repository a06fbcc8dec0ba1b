"""MCAP files: written so that a crash loses a quarter of a second, read whole or broken."""
