"""Classes of paths, each with the function that reads it in terms of the mechanism.

`PATHS` in :mod:`osimlite.simulation.elements.registry` names the module of each class.
"""
