"""The schedule: when a grain cart unloads which combine (Zhang 2014, 3.2-3.4)."""
