"""Measurements of paths and muscles over the ranges of the coordinates, for rules of the linter."""

from osimlite.lint.measuring.model import measure_model

__all__ = ["measure_model"]
