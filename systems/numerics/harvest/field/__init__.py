"""Fields as they are in files: crop, obstacles, gates, places of trucks, yields."""
