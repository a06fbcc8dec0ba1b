"""PX4's MAVLink: its missions, parameters, streams and commands."""
