"""Who goes first where paths meet, when each machine is where, and the rule of driving."""
