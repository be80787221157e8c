"""Who goes first where machines' paths meet, when each is where, and the rule by which they drive."""
