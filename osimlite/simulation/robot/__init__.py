"""Neutral robot: a mechanism as links and one-axis joints, from which engines and robot formats are made."""
