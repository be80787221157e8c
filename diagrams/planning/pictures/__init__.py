"""Plans and value functions over time and over the plane, as pictures and as a replay."""
