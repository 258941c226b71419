"""Mesh folders of svMultiPhysics and SimVascular."""
