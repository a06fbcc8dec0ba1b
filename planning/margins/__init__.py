"""What the required clearance is made of: everything that may part the vehicle's hull from the line, or the ground."""
