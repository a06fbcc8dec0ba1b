"""Files that other programs read and write: each format's writer and its own reader."""
