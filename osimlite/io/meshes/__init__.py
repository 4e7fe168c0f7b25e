"""Surfaces of triangles: search, reading and writing of mesh files."""
