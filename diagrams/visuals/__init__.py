"""Drawing in Meshcat, for every story: meshes, text, lights, and changes that are recorded."""
