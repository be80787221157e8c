"""The ports of the simulation on real devices and servers."""
