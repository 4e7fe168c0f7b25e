"""Models changed as a whole: OpenSim's operators on models (ModOp...), and the words of ``osimlite modify``."""
