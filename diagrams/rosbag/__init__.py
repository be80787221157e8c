"""Runs as ROS 2 bags, which Foxglove, PlotJuggler and `ros2 bag` open."""
