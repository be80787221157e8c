"""Which landmarks and markers a picture shows, and where in it."""
