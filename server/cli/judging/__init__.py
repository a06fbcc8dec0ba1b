"""What a mission made anywhere is worth over a surface model: its proof, and its risk."""
