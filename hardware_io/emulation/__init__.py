"""Robots and radio without hardware: the real firmware in simavr, on wheels that are computed."""
