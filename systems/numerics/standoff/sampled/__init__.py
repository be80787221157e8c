"""The stand-off loop as a computer closes it: margins, regions of attraction, choice of gains."""
