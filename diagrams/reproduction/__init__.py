"""Every figure and table of the thesis's results made again, on one page."""
