"""Fields, and the ways of combines that harvest them from the perimeter inwards."""
