"""osimlite: build, check, translate and simulate OpenSim models without OpenSim."""

__version__ = "0.1.0"
