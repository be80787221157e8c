"""LeafSystems of the social story: making friends, reading their pictures, finding the evader."""
