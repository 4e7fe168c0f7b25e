"""Modification of models: OpenSim's operators (ModOp...), and the words of ``osimlite modify``."""
