"""Where a picture was taken, and where the evader in it is."""
