"""The arithmetic of the compiled engine: plain loops over arrays, which run as Python and compiled.

Nothing here knows a compiler; :mod:`osimlite.simulation.engines.compiled` compiles these functions and all that they
call. A mechanism with its forces is a `Structure` of integers, what is connected to what, and one vector of numbers;
functions take the `Numbers` that are views of that vector.
"""
