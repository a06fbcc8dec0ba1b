"""Several stations that see each other's vehicles through a Zenoh router: read only, no command crosses."""
