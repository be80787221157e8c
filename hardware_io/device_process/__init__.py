"""Devices in a process of their own, which a busy or dead controller does not hold up."""
