"""Helpers that know nothing of OpenSim: text, records, options, files, quantities, optional packages."""
