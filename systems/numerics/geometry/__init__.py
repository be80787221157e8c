"""Worlds of polygons: reading, cleaning, sight, clearance and motion in them."""
