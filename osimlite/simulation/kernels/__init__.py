"""The arithmetic of the compiled engine: plain loops over three vectors.

Nothing here knows a compiler; :mod:`osimlite.simulation.engines.machine_code` compiles these functions and all that
they call. :mod:`osimlite.simulation.kernels.layout` says what is where in the vectors.
"""
