"""Calibration of central cameras on pictures of checkerboards."""
