"""Content of models: one class per OpenSim component, by area. No XML, numpy or files here."""
