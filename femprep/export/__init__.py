"""One file per solver format, one table."""
