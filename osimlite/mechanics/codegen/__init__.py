"""Writers of kernels in other languages.

Kernels are written once, in a restricted Python: functions of floats, integers, vectors and tuples
of these. :mod:`osimlite.mechanics.codegen.reader` reads it; each writer produces one other
language. This package imports only kernels, laws and the standard library, because the build of a
wheel runs it in an environment without numpy.
"""
