"""Exhibits beyond the thesis: what else the same studies can tell."""
