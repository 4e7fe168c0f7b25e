"""What a model says: one class per OpenSim component, grouped by area. No XML, no numpy, no files in here."""
