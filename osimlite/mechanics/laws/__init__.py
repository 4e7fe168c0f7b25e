"""Force laws: pure functions of floats, in the symbols of the literature.

A law imports only `math` and other laws, and keeps nothing between calls. An interpreted engine
calls laws as they are, and a compiler needs each function and the few that it calls only. Parameters
that belong together are named tuples.
"""
