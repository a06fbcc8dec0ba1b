"""Who may come in and who may command: sign-in, limits, the operator's lease, sensors' tokens, the pages' stream."""
