"""LeafSystems of the planning story: the tractor-trailer, and what drives it."""
