"""Combines and carts in numbers: sizes, tanks, and what moves from one to the other."""
