"""The logs that the simulated vehicle writes of its own flights, each in the way of its autopilot's make."""
