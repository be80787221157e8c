"""Where combines drive to cut a whole field: rounds, swaths, lands, and what must be cut before."""
