"""Plain functions and dataclasses behind the systems; nothing here imports pydrake."""
