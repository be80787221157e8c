"""Ways through the maze: shortest routes, infrared ranges, and how robots keep apart."""
