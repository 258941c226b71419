"""Meshers behind a guard, element quality."""
