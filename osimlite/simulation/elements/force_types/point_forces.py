"""Forces between two points, and prescribed forces at a point of a body."""

from typing import Any

import numpy as np

from osimlite.mechanics.kernels.programs import run_binary_program
from osimlite.mechanics.laws.springs import point_spring_tension, spring_energy
from osimlite.mechanics.multibody.mechanism import GROUND, FramePlacement
from osimlite.schema.prescribed import PrescribedForce
from osimlite.schema.springs import ExpressionBasedPointToPointForce, PointToPointSpring
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.geometries.line import BetweenPoints
from osimlite.simulation.elements.geometries.load import Load, LoadGeometry
from osimlite.simulation.elements.parameters import Expression
from osimlite.simulation.elements.registry import register_force_type


def compute_point_spring(length: float, k: float, l0: float) -> tuple[float, float]:
    """Return tension and energy of a spring between two points.

    Args:
        length: distance of the points, m.
        k: stiffness, N/m.
        l0: rest length, m.

    Returns:
        Tension (N) and energy (J).
    """
    return point_spring_tension(length, k, l0), spring_energy(length - l0, k)


register_force_type(
    ForceType(
        PointToPointSpring,
        BetweenPoints(("socket_body1", "socket_body2")),
        compute_point_spring,
        inputs=("length",),
        outputs=("tension", "energy"),
        parameters=("stiffness", "rest_length"),
    )
)


register_force_type(
    ForceType(
        ExpressionBasedPointToPointForce,
        BetweenPoints(("body1", "body2"), as_written=True),
        run_binary_program,
        outputs=("tension",),
        parameters=(Expression("expression", ("d", "ddot")),),
    )
)


class PrescribedLoad(LoadGeometry):
    """Load of a PrescribedForce.

    As in OpenSim, a set that does not have three functions is ignored.
    """

    def read(self, builder: ElementBuilder, force: Any) -> Load:
        """Return the load of a force."""
        frame = builder.resolve_target(force, "socket_frame", force.socket_frame)
        placement = builder.find_placement(frame)
        ground = FramePlacement(GROUND, np.eye(4))
        groups = []
        for what in ("forceFunctions", "pointFunctions", "torqueFunctions"):
            functions = getattr(force, what).objects
            groups.append(
                tuple(
                    builder.read_function(force, item, what)
                    for item in functions
                    if len(functions) == 3
                )
            )
        start = f"{'ground' if force.forceIsGlobal else frame.name}_{force.name}"
        return Load(
            (f"{start}_f", f"{start}_p", f"{start}_torque_"),
            placement,
            ground if force.forceIsGlobal else placement,
            ground if force.pointIsGlobal else placement,
            *groups,
        )


register_force_type(ForceType(PrescribedForce, PrescribedLoad()))
