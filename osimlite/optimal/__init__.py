"""Optimal control: studies of OpenSim's Moco, solved by direct collocation with exact derivatives.

A study passes the modules in this order: `problem` reads what varies and between which `bounds`;
`goals` and `path_constraints` formulate the terms at one `point` of the grid; a transcription
scheme (`schemes`) connects the points; `program` assembles the nonlinear program with sparse exact
derivatives; `ipopt` solves it; `refinement` repeats this on finer meshes; `solution` collects the
results, and `simulation_check` integrates the model with the controls of a solution. `inverse` and
`track` make the studies of MocoInverse and MocoTrack.
"""
