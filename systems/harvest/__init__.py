"""LeafSystems of the harvest story: combines, carts, who unloads whom, and what is watched."""
