"""Parameters outside the vehicle: files of ground stations, comparing, what the autopilot's makers say of each."""
