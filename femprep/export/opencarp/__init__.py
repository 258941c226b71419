"""openCARP's files."""
