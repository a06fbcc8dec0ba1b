"""MAVLink: addresses, connections, one vehicle at a time, and the machines that speak its protocols."""
