"""What browsers and programs may ask: one router per subject."""
