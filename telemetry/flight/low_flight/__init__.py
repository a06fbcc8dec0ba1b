"""What the autopilot's own settings will do on a plan close to the ground."""
