"""Setup files: the tools that OpenSim runs on models, and what they are told."""
