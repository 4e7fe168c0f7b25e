"""Whether finished trials are good enough, by the limits that OpenSim's authors and others have published."""
