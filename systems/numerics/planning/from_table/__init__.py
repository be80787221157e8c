"""Plans by the value function, in the open and among walls."""
