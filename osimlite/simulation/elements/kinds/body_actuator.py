"""An actuator with six controls: a torque and a force on a body."""

from osimlite.schema.actuators import BodyActuator
from osimlite.simulation.elements.geometries.body import BODY
from osimlite.simulation.elements.kind import Kind


def wrench(
    tx: float, ty: float, tz: float, fx: float, fy: float, fz: float
) -> tuple[float, float, float, float, float, float]:
    """The controls: torque (N.m) and force (N)."""
    return tx, ty, tz, fx, fy, fz


KIND = Kind(
    BodyActuator,
    BODY,
    wrench,
    outputs=("tx", "ty", "tz", "fx", "fy", "fz"),
    controlled=True,
    labels={},
)
