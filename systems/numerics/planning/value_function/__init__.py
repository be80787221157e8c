"""Time to go to a goal from every state of a grid, by fast sweeping (Zhang 2014, 3.5.1)."""
