"""Contact of a station with the plane y = 0 of ground; what it does to ground moves nothing."""

from typing import Any

from osimlite.errors import ModelError
from osimlite.mechanics.laws.smooth_contact import station_contact_force
from osimlite.schema.contact_forces import MeyerFregly2016Force
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.body import STATION
from osimlite.simulation.elements.kind import Kind


def _check(builder: ElementBuilder, force: Any) -> None:
    if force.stiffness == 0.1 or force.latch_velocity == 0.0:
        raise ModelError(
            f"'{builder.path(force)}' needs a latch_velocity that is not 0, and a stiffness other than 0.1"
        )


KIND = Kind(
    MeyerFregly2016Force,
    STATION,
    station_contact_force,
    outputs=("fx", "fy", "fz"),
    parameters=(
        "stiffness",
        "dissipation",
        "spring_resting_length",
        "dynamic_friction",
        "viscous_friction",
        "latch_velocity",
    ),
    check=_check,
)
