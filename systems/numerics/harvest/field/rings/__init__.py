"""Rings round the crop, as closed lines that combines can drive."""
