"""VTK files read as arrays, once their sizes are known to fit."""
