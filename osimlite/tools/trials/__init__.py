"""Quality of finished trials, by limits that OpenSim's authors and others have published."""
