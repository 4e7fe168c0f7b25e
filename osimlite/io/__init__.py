"""Text and bytes to objects and back: documents (XML), tables of numbers, and meshes."""
