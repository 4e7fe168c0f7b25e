"""Humans that walk by reflexes: the scenarios of SCONE, run without it (docs/reflexes.md)."""
