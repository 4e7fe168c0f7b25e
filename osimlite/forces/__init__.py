"""The force laws: plain scalar functions of floats, each in the symbols of the literature.

No law imports anything but `math`, none calls one of another module, and none keeps anything between calls; so an
interpreted engine calls them as they are and a compiler may take each function with the few that it calls.
"""
