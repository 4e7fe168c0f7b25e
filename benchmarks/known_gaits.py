"""Passive walkers with compliant contact, compared with published results for rigid contact.

    python benchmarks/known_gaits.py

The published results are for impacts that are plastic and take no time. With compliant contact, the
difference from them should decrease as the contact becomes stiffer. There are three walkers:

- The rimless wheel rolls down a slope on its spokes. The speed before an impact is known in closed
  form.
- The simplest walking model (Garcia, Chatterjee, Ruina and Coleman, J. Biomech. Eng. 120, 1998) has
  a point mass at the hip and massless feet.
- The compass gait (Goswami, Thuilot and Espiau, Int. J. Robotics Research 17, 1998) has legs with
  mass.

The straight legs of the last two would scuff the ground. As in these papers, the swing foot has no
contact until it has passed the other leg. Each walker has a table with one row for each ground;
"stiffness" is that of the Hunt-Crossley contact, "slip" the transition velocity of its friction.
"""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt
from typing import Any, NamedTuple

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
"""Acceleration of gravity, m/s^2."""

FOOT_RADIUS = 2e-4
"""Radius of the contact spheres, m."""

ACCURACY = 1e-6
"""Relative accuracy of the integrator."""

STEPS = 8
"""Number of steps after which a gait counts as converged."""

FOOT_MASS = 5e-3
"""Mass of a foot that has none in the published model, kg."""


class Ground(NamedTuple):
    """Parameters of the contact with the ground."""

    stiffness: float
    """Stiffness of the Hunt-Crossley contact, Pa."""
    transition_velocity: float
    """Slip velocity at which friction is fully developed, m/s."""


# Friction that sticks is the limit of a small transition velocity, so both approach the rigid case.
GROUNDS = (Ground(1e7, 0.1), Ground(1e8, 0.03), Ground(1e9, 0.01))
"""Grounds of increasing stiffness."""

SIMPLEST_SLOPE = 0.009
"""Slope of the simplest walking model, rad."""

SIMPLEST_ANGLE = 0.200310901
"""Published angle of its stance leg just after a heel strike, rad."""

SIMPLEST_RATE = -0.199832473
"""Published rate of its stance leg just after a heel strike, divided by sqrt(g / leg length)."""


class LegParameters(NamedTuple):
    """Parameters of a walker with two straight legs of 1 m."""

    slope: float
    """Slope of the ground, rad."""
    hip_mass: float
    """Point mass at the hip, kg."""
    leg_mass: float
    """Point mass of each leg, kg."""
    mass_distance: float
    """Distance of the mass of a leg from the hip, m."""


SIMPLEST = LegParameters(SIMPLEST_SLOPE, hip_mass=1.0, leg_mass=FOOT_MASS, mass_distance=1.0)
COMPASS = LegParameters(radians(3.0), hip_mass=10.0, leg_mass=5.0, mass_distance=0.5)


class Gait(NamedTuple):
    """Last step of a converged gait."""

    period: float
    """Duration of the step, s."""
    length: float
    """Distance between the feet at the heel strike, m."""
    angle: float
    """Half of the angle between the legs at the heel strike, rad."""
    rate: float
    """Rate of the stance leg just after the heel strike, rad/s."""


def add_slope(model: Model, slope: float) -> ContactHalfSpace:
    """Add an inclined ground (slope in rad) to a model, and return its contact geometry."""
    plane = model.add(
        ContactHalfSpace(
            name="slope", socket_frame=model.ground, orientation=(0.0, 0.0, -pi / 2 - slope)
        )
    )
    assert isinstance(plane, ContactHalfSpace)
    return plane


def add_contact(
    model: Model,
    plane: ContactHalfSpace,
    body: Body,
    location: tuple[float, float, float],
    name: str,
    ground: Ground,
) -> None:
    """Add a sphere to a body, and its contact with a plane.

    Args:
        model: model to extend.
        plane: contact geometry of the ground.
        body: body of the sphere.
        location: centre of the sphere in the body (m).
        name: name of the force.
        ground: parameters of the contact.
    """
    sphere = model.add(
        ContactSphere(
            name=f"{name}_sphere", socket_frame=body, location=location, radius=FOOT_RADIUS
        )
    )
    material = HuntCrossleyForce.ContactParameters(
        geometry=(sphere, plane),
        stiffness=ground.stiffness,
        # Impacts of the published models are plastic: the dissipation lets nothing bounce.
        dissipation=10.0,
        static_friction=1.0,
        dynamic_friction=1.0,
        viscous_friction=0.0,
    )
    model.add(
        HuntCrossleyForce(
            name=name,
            contact_parameters=HuntCrossleyForce.ContactParametersSet(objects=[material]),
            transition_velocity=ground.transition_velocity,
        )
    )


def add_planar_joint(model: Model, body: Body) -> None:
    """Let a body move freely in the sagittal plane."""
    model.add(
        PlanarJoint(
            name="planar",
            socket_parent_frame=model.ground,
            socket_child_frame=body,
            coordinates=[Coordinate(name=name) for name in ("rz", "tx", "ty")],
        )
    )


# ------------------------------------------------------------------------------------ rimless wheel
def build_wheel(ground: Ground, spokes: int, slope: float, inertia: float) -> Model:
    """Return a rimless wheel of 1 kg on spokes of 1 m.

    Args:
        ground: parameters of the contact.
        spokes: number of spokes.
        slope: slope of the ground (rad).
        inertia: moment of inertia about the hub (kg m^2).
    """
    model = Model(name="RimlessWheel", gravity=(0.0, -GRAVITY, 0.0))
    hub = model.add(Body(name="hub", mass=1.0, inertia=(1.0, 1.0, inertia, 0.0, 0.0, 0.0)))
    add_planar_joint(model, hub)
    plane = add_slope(model, slope)
    for index in range(spokes):
        angle = -pi / 2 + 2.0 * pi * index / spokes
        location = (1.0 - FOOT_RADIUS) * cos(angle), (1.0 - FOOT_RADIUS) * sin(angle), 0.0
        add_contact(model, plane, hub, location, f"spoke{index}", ground)
    return model


def compute_rigid_speed(spokes: int, slope: float, inertia: float) -> float:
    """Return the speed of the wheel with rigid contact just before an impact (rad/s).

    An impact multiplies the speed by a factor. In the steady state, the energy that it takes is
    what gravity adds until the next impact.

    Args:
        spokes: number of spokes.
        slope: slope of the ground (rad).
        inertia: moment of inertia about the hub (kg m^2).
    """
    half = pi / spokes
    factor = 1.0 - (1.0 - cos(2.0 * half)) / (1.0 + inertia)
    return sqrt(4.0 * GRAVITY * sin(half) * sin(slope) / ((1.0 + inertia) * (1.0 - factor**2)))


def measure_wheel_speed(
    ground: Ground, spokes: int = 8, slope: float = 0.08, inertia: float = 0.1
) -> tuple[float, float]:
    """Simulate the wheel far down the slope.

    Args:
        ground: parameters of the contact.
        spokes: number of spokes.
        slope: slope of the ground (rad).
        inertia: moment of inertia about the hub (kg m^2).

    Returns:
        Mean speed just before the last impacts, and the speed with rigid contact (rad/s).
    """
    rigid = compute_rigid_speed(spokes, slope, inertia)
    with Simulation(build_wheel(ground, spokes, slope, inertia), "compiled") as simulation:
        engine: Any = simulation.engine
        # The wheel stands on spoke 0 and rolls towards +x.
        y = simulation.initial_state(
            {"tx": sin(slope), "ty": cos(slope)},
            {"rz": -rigid, "tx": rigid * cos(slope), "ty": -rigid * sin(slope)},
        )
        # After 20 s the wheel has its steady speed.
        runs = run_many(engine, [y], 20.0, accuracy=ACCURACY, most_events=4000, event_states=True)
        rate_offset = list(engine.order).index(0) + len(engine.order)
        speeds = []
        latest_spoke: set[str] = set()
        for (_, name, begins), state in zip(runs.events[0], runs.event_states[0], strict=True):
            # Only the first contact of a spoke is an impact; later ones are rattling.
            if begins and name not in latest_spoke:
                speeds.append(-float(state[rate_offset]))
                latest_spoke = {name}
        return float(np.mean(speeds[-8:])), rigid


# -------------------------------------------------------------------------------- two straight legs
def build_legs(ground: Ground, parameters: LegParameters) -> Model:
    """Return a walker with two straight legs of 1 m, each with a point mass."""
    model = Model(name="TwoLegs", gravity=(0.0, -GRAVITY, 0.0))
    hip = model.add(
        Body(name="hip", mass=parameters.hip_mass, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    )
    add_planar_joint(model, hip)
    plane = add_slope(model, parameters.slope)
    for name in ("right", "left"):
        mass_center = (0.0, -parameters.mass_distance, 0.0)
        leg = model.add(Body(name=name, mass=parameters.leg_mass, mass_center=mass_center))
        joint = PinJoint(name=f"{name}_hip", coordinates=[Coordinate(name=f"{name}_rz")])
        model.add(joint.between(hip, leg))
        add_contact(model, plane, leg, (0.0, -(1.0 - FOOT_RADIUS), 0.0), f"{name}_foot", ground)
    return model


class Legs:
    """Simulation of two straight legs whose swing foot has no contact until it is ahead.

    Args:
        ground: parameters of the contact.
        parameters: parameters of the legs.
    """

    def __init__(self, ground: Ground, parameters: LegParameters) -> None:
        self.simulation = Simulation(build_legs(ground, parameters), "compiled")
        self.engine: Any = self.simulation.engine
        self.slope = parameters.slope
        infos = self.simulation.mechanism.coordinates
        self.names = [infos[index].name for index in self.engine.order]
        self.swing_numbers = [
            self._disable_contact(foot, ground, parameters) for foot in ("right_foot", "left_foot")
        ]
        self.normal = (sin(self.slope), cos(self.slope), 0.0)
        self.rate = 0.0

    def _disable_contact(self, foot: str, ground: Ground, parameters: LegParameters) -> Any:
        """Return the parameters of the engine in which one foot has no contact.

        The contact remains with a stiffness of zero, so that the layout of the engine is the same.
        """
        # Each foot needs parameters of its own, since either may swing.
        model = build_legs(ground, parameters)
        for force in model.components(HuntCrossleyForce):
            if force.name == foot:
                force.contact_parameters.objects[0].stiffness = 0.0
        with Simulation(model, "compiled") as simulation:
            engine: Any = simulation.engine
            return engine.numbers.copy()

    def get_index(self, name: str) -> int:
        """Return the index of a coordinate in the state."""
        return self.names.index(name)

    def create_start(self, angle: float, rate: float, swing_rate: float) -> Any:
        """Return the state just after a heel strike of the right leg, with the left leg behind.

        Args:
            angle: angle of the stance leg from the normal of the slope, and half of the angle
                between the legs (rad).
            rate: rate of the stance leg (rad/s).
            swing_rate: rate of the swing leg (rad/s).
        """
        stance = -self.slope + angle
        values = {
            "right_rz": stance,
            "left_rz": -self.slope - angle,
            "tx": -sin(stance),
            "ty": cos(stance),
        }
        speeds = {
            "right_rz": rate,
            "left_rz": swing_rate,
            "tx": -rate * cos(stance),
            "ty": -rate * sin(stance),
        }
        return np.array(self.simulation.initial_state(values, speeds))

    def simulate_step(self, y: Any, stance: int) -> tuple[float, Any] | None:
        """Simulate from a heel strike to the next one of the other foot.

        Also sets `rate` to the rate of the stance leg once the other foot has left the ground.

        Args:
            y: state just after a heel strike.
            stance: index of the foot in front, 0 for right and 1 for left.

        Returns:
            Duration of the step (s) and the state at its end, or None if the walker falls.
        """
        legs = ("right", "left")
        swing = 1 - stance
        duration = 0.0
        # Both feet are in contact until the one behind leaves the ground.
        if self.engine.find_touching_contacts(0.0, y.tolist()) >> swing & 1:
            lift = Watch("lift", contact=f"{legs[swing]}_foot", stops=-1)
            runs = self._integrate(y, None, 0.5, lift)
            y = runs.states[0]
            duration = float(runs.times[0])
        # Take the rate from the velocity of the hip, because the foot may slip a little.
        angle = float(y[self.get_index(f"{legs[stance]}_rz")])
        speeds = y[len(self.names) :]
        self.rate = -float(
            speeds[self.get_index("tx")] * cos(angle) + speeds[self.get_index("ty")] * sin(angle)
        )
        # The leg swings forward without contact until it is ahead of the normal of the slope.
        ahead = Watch("ahead", coordinate=f"{legs[swing]}_rz", level=-self.slope, stops=1)
        runs = self._integrate(y, self.swing_numbers[swing], 5.0, ahead)
        if runs.endings[0] != ENDING.STOPPED:
            return None
        y = runs.states[0]
        duration += float(runs.times[0])
        # Then it continues until the foot reaches the slope.
        down = Watch(
            "down",
            body=legs[swing],
            station=(0.0, -(1.0 - FOOT_RADIUS), 0.0),
            direction=self.normal,
            level=FOOT_RADIUS,
            stops=-1,
        )
        runs = self._integrate(y, self.swing_numbers[swing], 5.0, down)
        if runs.endings[0] != ENDING.STOPPED:
            return None
        return duration + float(runs.times[0]), runs.states[0]

    def _integrate(self, y: Any, numbers: Any, to: float, watch: Watch) -> Any:
        return run_many(
            self.engine,
            [y],
            to,
            numbers=numbers,
            accuracy=ACCURACY,
            watches=[watch],
            most_events=4,
        )


def find_gait(legs: Legs, y: Any) -> Gait | None:
    """Return the gait to which the legs converge from a state, or None if they fall."""
    stance = 0
    period = 0.0
    for _ in range(STEPS):
        step = legs.simulate_step(y, stance)
        if step is None:
            return None
        period, y = step
        stance = 1 - stance
    right, left = (float(y[legs.get_index(f"{name}_rz")]) for name in ("right", "left"))
    angle = abs(right - left) / 2.0
    return Gait(period, 2.0 * sin(angle), angle, legs.rate)


def create_table(title: str, headings: tuple[str, ...]) -> Table:
    """Return an empty table whose first columns describe the ground."""
    table = Table(title=title)
    for heading in ("stiffness (Pa)", "slip (m/s)", *headings):
        table.add_column(heading, justify="right")
    return table


def format_ground(ground: Ground) -> list[str]:
    """Return the first cells of a row."""
    return [f"{ground.stiffness:.0e}", f"{ground.transition_velocity:g}"]


def compare_wheel() -> Table:
    """Return the table of the rimless wheel."""
    title = "Rimless wheel, 8 spokes, slope 0.08: speed before an impact (rad/s)"
    table = create_table(title, ("speed", "rigid", "difference"))
    for ground in GROUNDS:
        speed, rigid = measure_wheel_speed(ground)
        cells = (f"{speed:.6f}", f"{rigid:.6f}", f"{speed / rigid - 1.0:+.2%}")
        table.add_row(*format_ground(ground), *cells)
    return table


def compare_simplest_model() -> Table:
    """Return the table of the simplest walking model."""
    table = create_table(
        f"Simplest walking model, slope {SIMPLEST_SLOPE:g} "
        f"(published: {SIMPLEST_ANGLE}, {SIMPLEST_RATE})",
        ("step angle (rad)", "rate / sqrt(g/l)", "difference of angle", "difference of rate"),
    )
    for ground in GROUNDS:
        legs = Legs(ground, SIMPLEST)
        start_rate = SIMPLEST_RATE * sqrt(GRAVITY)
        # In the published gait, the swing leg starts with this multiple of the rate.
        swing_rate = start_rate * cos(2.0 * SIMPLEST_ANGLE)
        gait = find_gait(legs, legs.create_start(SIMPLEST_ANGLE, start_rate, swing_rate))
        if gait is None:
            table.add_row(*format_ground(ground), "falls")
            continue
        rate = gait.rate / sqrt(GRAVITY)
        table.add_row(
            *format_ground(ground),
            f"{gait.angle:.6f}",
            f"{rate:.6f}",
            f"{gait.angle / SIMPLEST_ANGLE - 1.0:+.2%}",
            f"{rate / SIMPLEST_RATE - 1.0:+.2%}",
        )
    return table


def compare_compass_gait() -> Table:
    """Return the table of the compass gait."""
    title = "Compass gait, mu = 2, beta = 1, 3 degrees (published: 0.734 s, 0.535 m)"
    table = create_table(title, ("period (s)", "step length (m)"))
    for ground in GROUNDS:
        legs = Legs(ground, COMPASS)
        # A state near the published gait cycle.
        gait = find_gait(legs, legs.create_start(0.2708, -1.0923, -0.3772))
        cells = ("falls", "") if gait is None else (f"{gait.period:.5f}", f"{gait.length:.5f}")
        table.add_row(*format_ground(ground), *cells)
    return table


def main() -> None:
    console = Console()
    console.print(compare_wheel())
    console.print(compare_simplest_model())
    console.print(compare_compass_gait())


if __name__ == "__main__":
    main()
