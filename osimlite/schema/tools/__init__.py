"""Setup files: the tools that OpenSim runs on models, and their settings."""
