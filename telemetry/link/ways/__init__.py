"""The ways to the one adopted vehicle: how good each is, which one is in use, and what comes over several; sans-IO."""
