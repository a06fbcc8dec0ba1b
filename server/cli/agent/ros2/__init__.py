"""``hedgehop ros2``: topics of a robot that speaks rmw_zenoh, and what Hedgehop tells it."""
