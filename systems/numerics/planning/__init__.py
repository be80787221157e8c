"""Time-optimal motion of a tractor with a trailer: model, bounds, solvers."""
