"""What the pages show: the mesh, slices with outlines, long-axis cuts, the scene, the bull's eye."""
