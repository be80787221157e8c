"""What would it take? Figures of a plan, and of fleets of other sizes by a model of carts."""
