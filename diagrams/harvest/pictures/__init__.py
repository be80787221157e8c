"""Pictures of harvests: paths of combines, loads, the field."""
