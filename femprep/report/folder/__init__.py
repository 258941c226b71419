"""The folder that is there whole or not at all."""
