"""Drake LeafSystems, one component to a file, grouped by story."""
