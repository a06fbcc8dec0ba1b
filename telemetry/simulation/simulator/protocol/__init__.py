"""The simulated vehicle's MAVLink: machines without sockets or clock, and the sockets."""
