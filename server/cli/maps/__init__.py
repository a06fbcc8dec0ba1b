"""Maps made from recordings and from bags of ROS."""
