"""Many games at once: grids of cells, runs with seeds of their own, tables, statistics."""
