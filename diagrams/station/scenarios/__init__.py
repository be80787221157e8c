"""Built-in laboratories."""
