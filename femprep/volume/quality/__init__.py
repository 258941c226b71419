"""Anyone's mesh and limits in, what it is worth out: checks, limits, record."""
