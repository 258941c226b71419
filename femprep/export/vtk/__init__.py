"""VTK files, legacy and XML: read within their sizes, and written."""
