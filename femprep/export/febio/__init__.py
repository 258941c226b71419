"""FEBio models."""
