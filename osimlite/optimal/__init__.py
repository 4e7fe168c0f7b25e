"""Optimal control: the studies of OpenSim's Moco, by direct collocation with exact derivatives.

A study becomes a `problem` (what varies, between which bounds), its equations at one point of the
grid become formulas (`point`), a `scheme` says how points hang together, `program` is the nonlinear
program of all that with sparse exact derivatives, and `ipopt` solves it; `refinement` makes the
mesh finer where that is needed, and `simulated` integrates what was found. A goal is one module in
`goals`, which is found by the name of its class.
"""
