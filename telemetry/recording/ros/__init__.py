"""Bags of robots with ROS 1 or ROS 2: what is in them, their points placed by their transforms, and the way back."""
