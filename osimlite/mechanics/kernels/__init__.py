"""The arithmetic of mechanisms and forces: plain loops over three vectors.

Nothing here knows a compiler; :mod:`osimlite.simulation.engines.machine_code` compiles these
functions and all that they call, and the mechanism runs them as Python.
:mod:`osimlite.mechanics.kernels.layout` describes the layout of the vectors.
"""
