"""Robots on ROS 2, by DDS and without ROS: the link to them, and a driver that stands in."""
