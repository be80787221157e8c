"""The planning story: comparing methods, pictures, simulation."""
