"""Geometries: where forces act. Each computes arguments of a law, and applies the law's outputs."""
