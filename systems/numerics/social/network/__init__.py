"""Friends, requests and albums: one interface, Algorithms 2 and 3, and their chances."""
