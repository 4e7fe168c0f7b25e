"""Exact derivatives of models: CasADi functions, tangents, linearization and sensitivities."""
