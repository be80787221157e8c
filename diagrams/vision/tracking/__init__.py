"""Tracking on pictures alone: scenarios, diagram, run, scene and report."""
