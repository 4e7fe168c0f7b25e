"""Conversion of MJCF, the models of MuJoCo, to OpenSim.

MuJoCo compiles the file, so that defaults, classes, includes and attached models are resolved by
MuJoCo itself; `source` loads the compiled model. A conversion is a list of passes over a `Draft`
(in `convert`): each pass adds components to the model of the draft and accounts for what it read in
the draft's fidelity.

`joints` and `bodies` make the mechanism, `shapes` what bodies look like, `contacts` what touches.
`tendon_lengths` computes tendons as MuJoCo 3 or 4 does; `tendons` selects the path that is nearest
in sampled poses (`poses`), or fits a polynomial (`polynomials`). `muscles` and `actuators` act on
paths and coordinates, with curves fitted by `muscle_fits`; `equalities` become constraints and
`keyframes` a table.
"""
