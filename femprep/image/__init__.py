"""Label maps in: read, choose structures, repair with a report, boundary points."""
