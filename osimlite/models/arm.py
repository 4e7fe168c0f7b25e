"""A forearm with a weight."""

from __future__ import annotations

from math import pi

from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Body
from osimlite.schema.geometry_types import Cylinder
from osimlite.schema.joints import PinJoint
from osimlite.schema.model import Model
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle

UPPER_ARM_LENGTH_M = 0.3
"""Length of the upper arm (m); the shoulder is 1 m above the origin of ground."""
FOREARM_LENGTH_M = 0.25
"""Length of the forearm (m), for its shape only."""


def arm() -> Model:
    """Build a forearm with a weight, a muscle that flexes the elbow and one that extends it.

    Returns:
        The model.
    """
    # OpenSim's default gravity.
    model = Model(name="Arm", gravity=(0.0, -9.80665, 0.0))
    fore = Body(
        name="forearm",
        mass=2.0,
        mass_center=(0.0, -0.15, 0.0),
        inertia=(0.02, 0.002, 0.02, 0.0, 0.0, 0.0),
    )
    fore.attached_geometry.append(
        Cylinder(name="bone", radius=0.03, half_height=FOREARM_LENGTH_M / 2.0, socket_frame="..")
    )
    model.add(fore)
    elbow = Coordinate(name="elbow", range=(0.0, pi * 0.8), default_value=0.5)
    model.add(
        PinJoint(name="elbow", coordinates=[elbow]).between(
            model.ground, fore, at=(0.0, 1.0 - UPPER_ARM_LENGTH_M, 0.0)
        )
    )
    for name, force, fiber, slack, points in (
        ("flexor", 900.0, 0.12, 0.20, (("ground", 0.03, 0.98), ("forearm", 0.02, -0.05))),
        ("extensor", 900.0, 0.12, 0.15, (("ground", -0.03, 0.98), ("forearm", -0.02, 0.02))),
    ):
        path = GeometryPath(name="path")
        # All points lie in the plane of motion.
        for number, (body, x, y) in enumerate(points):
            frame = "/ground" if body == "ground" else f"/bodyset/{body}"
            path.path_point_set.objects.append(
                PathPoint(name=f"p{number}", socket_parent_frame=frame, location=(x, y, 0.0))
            )
        model.add(
            DeGrooteFregly2016Muscle(
                name=name,
                max_isometric_force=force,
                optimal_fiber_length=fiber,
                tendon_slack_length=slack,
                # A rigid tendon has no state of its own, which makes the arm a small and fast
                # example.
                ignore_tendon_compliance=True,
                fiber_damping=0.01,
                default_activation=0.05,
                geometry_path=path,
            )
        )
    return model
