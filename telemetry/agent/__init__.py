"""The sensor link: what a companion computer on the drone sends to the ground station, over one WebSocket."""
