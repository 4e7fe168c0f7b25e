"""Paths and muscles measured over the ranges of the coordinates, for the rules of the linter that are about that."""

from osimlite.lint.measuring.model import measure_model

__all__ = ["measure_model"]
