"""Helpers independent of OpenSim: text, records, options, files, quantities, optional packages."""
