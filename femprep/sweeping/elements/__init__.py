"""Matched surfaces in, layers of elements between them out, the poor ones mended."""
