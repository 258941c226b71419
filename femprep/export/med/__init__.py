"""MED files of Salome and code_aster."""
