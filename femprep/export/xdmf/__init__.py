"""XDMF and HDF5 for dolfinx and legacy FEniCS."""
