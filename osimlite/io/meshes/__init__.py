"""Surfaces of triangles, and the files that hold them: where they are found, read and written."""
