"""From the cells of an occupancy map to polygons: images, free cells, outlines, simplification."""
