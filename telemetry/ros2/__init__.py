"""Live ROS 2 over the wire of rmw_zenoh, without ROS: topics read as sensors, and what Hedgehop knows told back."""
