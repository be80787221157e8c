"""An audit of what machines did in a harvest, from their log alone."""
