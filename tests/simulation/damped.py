"""Model with dampers that integrate the dissipated energy."""

from __future__ import annotations

from osimlite import Body, Coordinate, CoordinateLimitForce, Model, PinJoint, SliderJoint
from osimlite.schema.springs import BushingForce

STATES = [
    "/forceset/slack/dissipated_energy",
    "/forceset/stop/dissipatedEnergy",
    "/forceset/locked_stop/dissipatedEnergy",
    "/forceset/disc/dissipated_energy",
]
"""Paths of the dissipated energies in OpenSim, in its order."""


def damped() -> Model:
    """Return a slide and three pins in a chain, one pin locked, with two bushings and a limit for each pin."""
    model = Model(name="damped")
    below = model.ground
    for number, kind in enumerate((SliderJoint, PinJoint, PinJoint, PinJoint)):
        inertia = (0.02, 0.03, 0.02, 0, 0, 0)
        body = model.add(
            Body(name=f"b{number}", mass=1.0, mass_center=(0.05, -0.2, 0), inertia=inertia)
        )
        start = Coordinate(
            name=f"q{number}", default_value=0.3, default_speed_value=1.0, locked=number == 2
        )
        joint = kind(name=f"j{number}", coordinates=[start])
        model.add(
            joint.between(below, body, at=(0, -0.4 if number else 0, 0), turned=(0, 0.1, 0.2))
        )
        below = body
    limits = {"upper_limit": 5.0, "upper_stiffness": 0.5, "damping": 0.05, "transition": 10.0}
    model.add(
        BushingForce(
            name="slack",
            socket_frame1="/ground",
            socket_frame2="/bodyset/b0",
            translational_stiffness=(9, 9, 9),
        ),
        CoordinateLimitForce(
            name="stop", coordinate="q1", compute_dissipation_energy=True, **limits
        ),
        CoordinateLimitForce(
            name="locked_stop", coordinate="q2", compute_dissipation_energy=True, **limits
        ),
        CoordinateLimitForce(name="quiet_stop", coordinate="q3", **limits),
        BushingForce(
            name="disc",
            socket_frame1="/bodyset/b0",
            socket_frame2="/bodyset/b3",
            rotational_stiffness=(2, 2, 2),
            rotational_damping=(0.2, 0.1, 0.3),
            translational_stiffness=(40, 20, 30),
            translational_damping=(2, 1, 3),
        ),
    )
    return model
