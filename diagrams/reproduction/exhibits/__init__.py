"""The exhibits, one file for those of a story, and what an exhibit is."""
