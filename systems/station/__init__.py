"""LeafSystems between a controller and its robots: channels, receivers, gates, players."""
