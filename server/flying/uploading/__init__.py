"""What is sent to a vehicle: prepared in a worker, sent, and read back."""
