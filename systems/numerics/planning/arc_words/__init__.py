"""Words of arcs, each one control held for a while, in closed form, and where they enter a box."""
