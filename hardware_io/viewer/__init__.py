"""The operator's view, in a process of its own, and what the operator may say."""
