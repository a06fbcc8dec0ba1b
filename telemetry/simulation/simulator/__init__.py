"""A simulated multirotor that any ground station can fly: world, motion and autopilot, with MAVLink as the shell."""
