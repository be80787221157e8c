"""The plan of a harvest: where every machine is at every time, before it begins."""
