"""The force laws: plain functions of floats, each in the symbols of the literature.

No law imports anything but `math` and other laws, and none keeps anything between calls; so an
interpreted engine calls them as they are and a compiler may take each function with the few that it
calls. Numbers that go together are a named tuple.
"""
