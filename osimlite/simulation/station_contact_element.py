"""Contact of a station with the plane y = 0 of ground, as a force element."""

from __future__ import annotations

from dataclasses import dataclass

from osimlite.errors import ModelError
from osimlite.multibody.mechanism import GROUND
from osimlite.schema.contact_forces import MeyerFregly2016Force
from osimlite.simulation.elements import ElementBuilder, Triple, triple
from osimlite.simulation.field import Writer
from osimlite.simulation.spring_elements import Element


@dataclass(frozen=True)
class StationContact(Element):
    """One MeyerFregly2016Force; its energy is not known and counts as none.

    Attributes:
        station: name of the point in the model.
        body: that it is on.
        point: in the body, m.
        constants: k, c, l0, ud, uv, vl of the law.
    """

    station: str
    body: int
    point: Triple
    constants: tuple[float, ...]

    @classmethod
    def of(cls, builder: ElementBuilder, force: MeyerFregly2016Force) -> StationContact:
        """The element of a force."""
        station = builder.target(force, "socket_station", force.socket_station)
        body, placed = builder.placement(builder.target(station, "socket_parent_frame", station.socket_parent_frame))
        point = triple(placed[:3, :3] @ station.location + placed[:3, 3])
        constants = (
            force.stiffness,
            force.dissipation,
            force.spring_resting_length,
            force.dynamic_friction,
            force.viscous_friction,
            force.latch_velocity,
        )
        builder.check(force, (*point, *constants))
        if force.stiffness == 0.1 or force.latch_velocity == 0.0:
            raise ModelError(
                f"'{builder.path(force)}' needs a latch_velocity that is not 0, and a stiffness other than 0.1"
            )
        return cls(builder.path(force), force.name, station.name, body, point, constants)

    def write(self, writer: Writer) -> None:
        """Write the force; what it does to ground moves nothing."""
        script, chain = writer.script, writer.chain
        point = chain.point(script, self.body, self.point)
        columns = chain.columns(script, GROUND, self.body, point)
        velocity = chain.velocity(script, columns)
        fx, fy, fz = writer.call("station_contact_force", point[1], *velocity, *self.constants, results=3)
        writer.push(columns, (fx, fy, fz))
        writer.keep(0, fx, fy, fz, 0.0)

    @property
    def columns(self) -> tuple[str, ...]:
        """The force on the station, in ground."""
        return tuple(f"{self.name}.{self.station}.force.{axis}" for axis in "XYZ")
