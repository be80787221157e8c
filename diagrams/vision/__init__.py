"""Calibrating omni-directional cameras, and tracking on their pictures."""
