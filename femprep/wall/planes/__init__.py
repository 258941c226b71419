"""A segmentation in, where its wall is cut out: base, apex, and what agrees over phases."""
