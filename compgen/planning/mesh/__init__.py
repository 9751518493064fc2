"""Triangle meshes: STL files, and what is over a place."""
