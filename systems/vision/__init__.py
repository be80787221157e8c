"""LeafSystems of the vision story: cameras, and what estimates from their pictures."""
