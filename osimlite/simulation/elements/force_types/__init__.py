"""Force types: their laws and declarations, one module for each subject.

`FORCE_TYPES` in :mod:`osimlite.simulation.elements.registry` names the module of each class.
"""
