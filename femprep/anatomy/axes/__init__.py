"""The axes of a ventricle: found from labels or surfaces, its hand, its landmarks."""
