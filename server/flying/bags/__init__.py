"""Bags of ROS, brought in by pages."""
