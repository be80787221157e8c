"""Calibration of omni-directional cameras: reports, pictures, and estimates drawn into pictures."""
