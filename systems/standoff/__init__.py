"""LeafSystems that keep a distance by a biased estimate: estimator, controller, closed loop."""
