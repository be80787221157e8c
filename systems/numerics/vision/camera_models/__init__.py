"""Models of central cameras: from points to pixels and back, and the files that hold them."""
