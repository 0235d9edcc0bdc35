"""Mesh files of other programs: solids and named faces as the file holds them, and how they become tetrahedra."""
