"""The kernels in other languages: one reader of the Python that they are written in, a writer for each language."""
