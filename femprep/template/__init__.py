"""Pre-meshed spheres and their store."""
