"""Kernels as C++17, for plain numbers and for numbers with derivatives.

The text needs `cmath` and `cstdint` only, throws nothing and has no global variables, so that it
can be compiled for other processors later. It keeps the names of the Python, and contains each line
of it as a comment.
"""

from osimlite.mechanics.codegen.cplusplus.library import HEADER as HEADER
from osimlite.mechanics.codegen.cplusplus.library import header_text as header_text
from osimlite.mechanics.codegen.cplusplus.library import write_library as write_library
from osimlite.mechanics.codegen.cplusplus.library import write_units as write_units
