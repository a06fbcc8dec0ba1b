"""What Review looks at beside recordings: files of raw radar samples, and scenarios."""
