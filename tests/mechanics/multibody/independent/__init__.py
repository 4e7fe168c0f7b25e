"""Multibody mechanics in numpy by other formulas than those of the kernels, as a reference for tests."""
