"""A triangle mesh in, another one of the same surface out: subdivided, thinned, flipped, smoothed."""
