"""The station: the same ports in simulation, against emulated devices and on hardware."""
