"""Gaits whose rigid limits are published, under compliant contact: the stiffer the contact, the closer.

The rimless wheel rolls down a slope on its spokes; every impact is plastic, so that its speed is
known in closed form. The simplest walking model (Garcia, Chatterjee, Ruina and Coleman, J. Biomech.
Eng. 120, 1998) has a point mass at the hip and feet of no mass; the compass gait (Goswami, Thuilot
and Espiau, Int. J. Robotics Research 17, 1998) has legs of mass. Their straight legs would scuff:
as in these papers the foot that swings does not feel the ground until it has passed the other leg.
"""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from osimlite.mechanics.kernels.record import ENDING
from osimlite.schema.contact_types import ContactHalfSpace, ContactSphere
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.schema.frames import Body
from osimlite.schema.joints import PinJoint, PlanarJoint
from osimlite.schema.model import Model
from osimlite.simulation import Simulation
from osimlite.simulation.batches import Watch, run_many

GRAVITY = 9.81
FOOT = 2e-4
"""Radius of the spheres, m."""

GROUNDS = ((1e7, 0.1), (1e8, 0.03), (1e9, 0.01))
"""Stiffness (Pa) and transition velocity of friction (m/s): ever stiffer, both ways."""

ACCURACY = 1e-6
SIMPLEST = {"gamma": 0.009, "angle": 0.200310901, "rate": -0.199832473}
COMPASS = {"period": 0.734, "step": 0.535}
STEPS = 8
MASSLESS = 5e-3
"""Mass of a foot that should have none, kg."""


def ground(model: Model, slope: float) -> ContactHalfSpace:
    plane = model.add(
        ContactHalfSpace(
            name="slope", socket_frame=model.ground, orientation=(0.0, 0.0, -pi / 2 - slope)
        )
    )
    assert isinstance(plane, ContactHalfSpace)
    return plane


def touch(
    model: Model,
    plane: ContactHalfSpace,
    body: Body,
    at: tuple[float, float, float],
    name: str,
    K: float,
    vt: float,
) -> None:
    sphere = model.add(
        ContactSphere(name=f"{name}_sphere", socket_frame=body, location=at, radius=FOOT)
    )
    material = HuntCrossleyForce.ContactParameters(
        geometry=(sphere, plane), stiffness=K, dissipation=10.0, static_friction=1.0, dynamic_friction=1.0,
        viscous_friction=0.0,
    )  # fmt: skip
    model.add(
        HuntCrossleyForce(
            name=name,
            contact_parameters=HuntCrossleyForce.ContactParametersSet(objects=[material]),
            transition_velocity=vt,
        )
    )


def floating(model: Model, body: Body) -> None:
    model.add(
        PlanarJoint(
            name="planar",
            socket_parent_frame=model.ground,
            socket_child_frame=body,
            coordinates=[Coordinate(name=name) for name in ("rz", "tx", "ty")],
        )
    )


# ------------------------------------------------------------------------------------------------ rimless wheel
def wheel(K: float, vt: float, spokes: int, slope: float, inertia: float) -> Model:
    model = Model(name="RimlessWheel", gravity=(0.0, -GRAVITY, 0.0))
    hub = model.add(Body(name="hub", mass=1.0, inertia=(1.0, 1.0, inertia, 0.0, 0.0, 0.0)))
    floating(model, hub)
    plane = ground(model, slope)
    for k in range(spokes):
        angle = -pi / 2 + 2.0 * pi * k / spokes
        at = (1.0 - FOOT) * cos(angle), (1.0 - FOOT) * sin(angle), 0.0
        touch(model, plane, hub, at, f"spoke{k}", K, vt)
    return model


def wheel_speed(
    K: float, vt: float, spokes: int = 8, slope: float = 0.08, inertia: float = 0.1
) -> tuple[float, float]:
    """Mean speed of the wheel between two impacts far down the slope, as it is and rigid, in rad/s just before one."""
    half = pi / spokes
    kept = 1.0 - (1.0 - cos(2.0 * half)) / (1.0 + inertia)
    rigid = sqrt(4.0 * GRAVITY * sin(half) * sin(slope) / ((1.0 + inertia) * (1.0 - kept**2)))
    with Simulation(wheel(K, vt, spokes, slope, inertia), "compiled") as simulation:
        engine: Any = simulation.engine
        # It stands on spoke 0 and rolls towards +x.
        y = simulation.initial_state(
            {"tx": sin(slope), "ty": cos(slope)},
            {"rz": -rigid, "tx": rigid * cos(slope), "ty": -rigid * sin(slope)},
        )
        runs = run_many(engine, [y], 20.0, accuracy=ACCURACY, most_events=4000, event_states=True)
        speeds = []
        seen: set[str] = set()
        for (_, name, begins), state in zip(runs.events[0], runs.event_states[0], strict=True):
            # The first touch of a spoke counts, not what it rattles.
            if begins and name not in seen:
                speeds.append(-float(state[list(engine.order).index(0) + len(engine.order)]))
                seen = {name}
        return float(np.mean(speeds[-8:])), rigid


# ---------------------------------------------------------------------------------------------- two straight legs
def two_legs(K: float, vt: float, slope: float, hip: float, leg: float, above: float) -> Model:
    """Legs of 1 m with a point mass each, so far from the hip (m)."""
    model = Model(name="TwoLegs", gravity=(0.0, -GRAVITY, 0.0))
    pelvis = model.add(Body(name="hip", mass=hip, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    floating(model, pelvis)
    plane = ground(model, slope)
    for name in ("right", "left"):
        body = model.add(Body(name=name, mass=leg, mass_center=(0.0, -above, 0.0)))
        model.add(
            PinJoint(name=f"{name}_hip", coordinates=[Coordinate(name=f"{name}_rz")]).between(
                pelvis, body
            )
        )
        touch(model, plane, body, (0.0, -(1.0 - FOOT), 0.0), f"{name}_foot", K, vt)
    return model


class Legs:
    """Two straight legs walking, with the ground under the foot that swings taken away until it has passed."""

    def __init__(
        self, K: float, vt: float, slope: float, hip: float, leg: float, above: float
    ) -> None:
        self.simulation = Simulation(two_legs(K, vt, slope, hip, leg, above), "compiled")
        self.engine: Any = self.simulation.engine
        self.slope = slope
        infos = self.simulation.mechanism.coordinates
        self.names = [infos[place].name for place in self.engine.order]
        self.without = [
            self._without(foot, K, vt, slope, hip, leg, above)
            for foot in ("right_foot", "left_foot")
        ]
        self.normal = (sin(slope), cos(slope), 0.0)

    def _without(
        self, foot: str, K: float, vt: float, slope: float, hip: float, leg: float, above: float
    ) -> Any:
        """The numbers of a model one foot of which is so soft that it does not feel the ground."""
        model = two_legs(K, vt, slope, hip, leg, above)
        for force in model.components(HuntCrossleyForce):
            if force.name == foot:
                force.contact_parameters.objects[0].stiffness = 0.0
        with Simulation(model, "compiled") as simulation:
            engine: Any = simulation.engine
            return engine.numbers.copy()

    def place(self, name: str) -> int:
        """Place of a coordinate in the state."""
        return self.names.index(name)

    def start(self, angle: float, rate: float, swing: float) -> Any:
        """Just after a heel strike: the right leg in front stands, the left one is about to swing.

        Args: angle: of the leg that stands to the normal of the slope, and half of the angle
            between the legs. rate: of the leg that stands. swing: of the leg that swings.
        """
        from_normal = -self.slope
        standing, behind = from_normal + angle, from_normal - angle
        values = {
            "right_rz": standing,
            "left_rz": behind,
            "tx": -sin(standing),
            "ty": cos(standing),
        }
        speeds = {
            "right_rz": rate,
            "left_rz": swing,
            "tx": -rate * cos(standing),
            "ty": -rate * sin(standing),
        }
        return np.array(self.simulation.initial_state(values, speeds))

    def step(self, y: Any, standing: int) -> tuple[float, Any] | None:
        """From a heel strike of the standing foot to the next one of the other: how long it takes, and the state."""
        legs, feet = ("right", "left"), ("right_foot", "left_foot")
        swing = 1 - standing
        passed = 0.0
        # Both feet push until the one behind leaves the ground.
        if self.engine.find_touching_contacts(0.0, y.tolist()) >> swing & 1:
            runs = self._run(y, None, 0.5, [Watch("lift", contact=feet[swing], stops=-1)])
            y, passed = runs.states[0], float(runs.times[0])
        # The rate of the leg, as far as it moves the hip: its foot may slip a little.
        angle, n = float(y[self.place(f"{legs[standing]}_rz")]), len(self.names)
        self.rate = -float(
            y[n + self.place("tx")] * cos(angle) + y[n + self.place("ty")] * sin(angle)
        )
        # It swings through until it is ahead.
        ahead = Watch("ahead", coordinate=f"{legs[swing]}_rz", level=-self.slope, stops=1)
        runs = self._run(y, self.without[swing], 5.0, [ahead])
        if runs.endings[0] != ENDING.STOPPED:
            return None
        y, passed = runs.states[0], passed + float(runs.times[0])
        # And on until it comes down on the slope.
        down = Watch(
            "down",
            body=legs[swing],
            station=(0.0, -(1.0 - FOOT), 0.0),
            direction=self.normal,
            level=FOOT,
            stops=-1,
        )
        runs = self._run(y, self.without[swing], 5.0, [down])
        if runs.endings[0] != ENDING.STOPPED:
            return None
        return passed + float(runs.times[0]), runs.states[0]

    def _run(self, y: Any, numbers: Any, to: float, watches: list[Watch]) -> Any:
        return run_many(
            self.engine, [y], to, numbers=numbers, accuracy=ACCURACY, watches=watches, most_events=4
        )


def walk(legs: Legs, y: Any) -> dict[str, float] | None:
    """What the gait settles to."""
    standing, found = 0, None
    for _ in range(STEPS):
        found = legs.step(y, standing)
        if found is None:
            return None
        standing, y = 1 - standing, found[1]
    assert found is not None
    right, left = (float(y[legs.place(f"{name}_rz")]) for name in ("right", "left"))
    between = abs(right - left)
    return {
        "period": found[0],
        "step": 2.0 * sin(between / 2.0),
        "angle": between / 2.0,
        "rate": legs.rate,
    }


def main() -> None:
    console = Console()
    table = Table(title="Rimless wheel, 8 spokes, slope 0.08: speed before an impact (rad/s)")
    for heading in ("stiffness (Pa)", "slip (m/s)", "speed", "rigid", "difference"):
        table.add_column(heading, justify="right")
    for K, vt in GROUNDS:
        speed, rigid = wheel_speed(K, vt)
        table.add_row(
            f"{K:.0e}", f"{vt:g}", f"{speed:.6f}", f"{rigid:.6f}", f"{speed / rigid - 1.0:+.2%}"
        )
    console.print(table)
    table = Table(
        title="Simplest walking model, slope 0.009 (published: 0.200310901, -0.199832473)"
    )
    for heading in (
        "stiffness (Pa)",
        "slip (m/s)",
        "step angle",
        "rate",
        "difference",
        "of the rate",
    ):
        table.add_column(heading, justify="right")
    for K, vt in GROUNDS:
        legs = Legs(K, vt, SIMPLEST["gamma"], hip=1.0, leg=MASSLESS, above=1.0)
        rate = SIMPLEST["rate"] * sqrt(GRAVITY)
        found = walk(legs, legs.start(SIMPLEST["angle"], rate, rate * cos(2.0 * SIMPLEST["angle"])))
        if found is None:
            table.add_row(f"{K:.0e}", f"{vt:g}", "falls")
            continue
        angle, rate = found["angle"], found["rate"] / sqrt(GRAVITY)
        off = f"{angle / SIMPLEST['angle'] - 1.0:+.2%}", f"{rate / SIMPLEST['rate'] - 1.0:+.2%}"
        table.add_row(f"{K:.0e}", f"{vt:g}", f"{angle:.6f}", f"{rate:.6f}", *off)
    console.print(table)
    table = Table(title="Compass gait, mu = 2, beta = 1, 3 degrees (published: 0.734 s, 0.535 m)")
    for heading in ("stiffness (Pa)", "slip (m/s)", "period (s)", "step (m)"):
        table.add_column(heading, justify="right")
    for K, vt in GROUNDS:
        legs = Legs(K, vt, radians(3.0), hip=10.0, leg=5.0, above=0.5)
        found = walk(legs, legs.start(0.2708, -1.0923, -0.3772))
        table.add_row(
            f"{K:.0e}",
            f"{vt:g}",
            *((f"{found['period']:.5f}", f"{found['step']:.5f}") if found else ("falls", "")),
        )
    console.print(table)


if __name__ == "__main__":
    main()
