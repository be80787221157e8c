"""Pictures for people: what was recognised in a picture, and how well it tells places."""
