"""The stand-off story: the loop as a block diagram, its analysis, pictures."""
