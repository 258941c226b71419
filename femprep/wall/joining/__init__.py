"""Clipped surfaces in, the closed and tagged Wall out; the rings between them filled."""
