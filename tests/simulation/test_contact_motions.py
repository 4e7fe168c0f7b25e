"""Tests of contact against analytical motions: a bouncing ball, a sliding block."""

from __future__ import annotations

from math import exp, log, log1p, pi, radians, tan

import numpy as np
import pytest

from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    HuntCrossleyForce,
    Model,
    PlanarJoint,
)
from osimlite.simulation import Simulation

MASS, RADIUS, STIFFNESS, GRAVITY = 2.0, 0.1, 1e6, 9.80665


def on_floor(*, gravity=GRAVITY, height=RADIUS, slope=0.0, **material) -> Model:
    """Return a ball that does not rotate over a half space that descends along x, with these contact properties."""
    model = Model(name="floor", gravity=(0.0, -gravity, 0.0))
    body = model.add(Body(name="ball", mass=MASS, inertia=(0.01, 0.01, 0.01, 0, 0, 0)))
    joint = PlanarJoint(name="plane")
    joint.coordinates = [
        Coordinate(name="turn", locked=True),
        Coordinate(name="along", default_value=0.0),
        Coordinate(name="height", default_value=height),
    ]
    model.add(joint.between(model.ground, body, turned=(0, 0, -slope)))
    floor = ContactHalfSpace(
        name="floor", socket_frame=model.ground, orientation=(0, 0, -0.5 * pi - slope)
    )
    sphere = ContactSphere(name="sphere", socket_frame=body, radius=RADIUS)
    model.add(floor, sphere)
    contact = HuntCrossleyForce(name="contact", transition_velocity=0.05)
    contact.contact_parameters.objects.append(
        HuntCrossleyForce.ContactParameters(
            geometry=(floor, sphere), stiffness=STIFFNESS, **material
        )
    )
    model.add(contact)
    return model


def hertz() -> float:
    """Return the factor K (N/m^(3/2)) of Hertz's law: force = K depth^(3/2)."""
    k = 0.5 * STIFFNESS ** (2.0 / 3.0)
    return 4.0 / 3.0 * k * (RADIUS * k) ** 0.5


@pytest.fixture(params=["bullet", "compiled"])
def engine(request):
    return request.param


@pytest.mark.parametrize("dissipation", [0.0, 0.2, 1.0])
def test_bounce(engine, dissipation):
    """Without gravity, m v dv = -K d^(3/2) (1 + a v) dd with a = 3/2 c: speeds before and after have one integral.

    K. H. Hunt and F. R. E. Crossley (1975): e = 1 - c v for slow impacts.
    """
    speed = 2.0
    model = on_floor(gravity=0.0, height=RADIUS + 0.1, dissipation=dissipation)
    with Simulation(model, engine) as simulation:
        trajectory = simulation.run(
            0.2, accuracy=1e-10, initial_speeds={"height": -speed}, report_interval=1e-4
        )
    begin, end = (event["time_s"] for event in trajectory.summary["contact_events"])
    assert begin == pytest.approx(0.1 / speed, abs=1e-8)
    out = trajectory.speeds[-1][trajectory.coordinates.index("height")]
    a = 1.5 * dissipation

    def energy(v: float) -> float:
        """Return the integral of v / (1 + a v)."""
        return 0.5 * v * v if a == 0.0 else v / a - log1p(a * v) / a**2

    low, high = 0.0, speed if a == 0.0 else min(speed, 1.0 / a)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if energy(-middle) < energy(speed) else (low, middle)
    expected = low
    assert out == pytest.approx(expected, rel=1e-7)
    deepest = RADIUS - trajectory.values[:, trajectory.coordinates.index("height")].min()
    assert deepest == pytest.approx((2.5 * MASS / hertz() * energy(speed)) ** 0.4, rel=1e-4)
    if a == 0.0:
        # H. Hertz (1881): contact lasts 2.9432 times the deepest penetration over the speed.
        assert end - begin == pytest.approx(2.94328 * deepest / speed, rel=1e-4)
    else:
        assert 0.5 * (1.0 - dissipation * speed) < expected / speed < 1.0


def rest(slope=0.0):
    """Return the height at which the ball rests (m)."""
    return RADIUS - (MASS * GRAVITY * np.cos(slope) / hertz()) ** (2.0 / 3.0)


def test_sliding(engine):
    """With us = ud = u, friction is u m g above the transition velocity, and proportional to the velocity below it."""
    u, speed, vt = 0.4, 1.5, 0.05
    model = on_floor(height=rest(), dissipation=1.0, static_friction=u, dynamic_friction=u)
    to = 0.6
    with Simulation(model, engine) as simulation:
        end = simulation.run(to, accuracy=1e-10, initial_speeds={"along": speed}).values[-1]
    slow = (speed - vt) / (u * GRAVITY)
    assert slow < to
    left = vt * vt / (u * GRAVITY) * (1.0 - exp(-u * GRAVITY / vt * (to - slow)))
    expected = (speed * speed - vt * vt) / (2.0 * u * GRAVITY) + left
    assert end[1] == pytest.approx(expected, rel=1e-6)
    assert end[2] == pytest.approx(rest(), abs=1e-9)


def test_sticking_on_a_slope(engine):
    """Such friction does not hold: the ball creeps at the speed whose friction equals the weight along the slope."""
    u, slope, vt = 0.6, radians(20.0), 0.05
    model = on_floor(
        height=rest(slope), slope=slope, dissipation=1.0, static_friction=u, dynamic_friction=u
    )
    with Simulation(model, engine) as simulation:
        trajectory = simulation.run(1.0, accuracy=1e-9)
    speed = trajectory.speeds[-1][trajectory.coordinates.index("along")]
    assert speed == pytest.approx(vt * tan(slope) / u, rel=1e-6)


def test_sliding_down_a_slope(engine):
    """On a slope too steep for friction, viscous friction leads to a constant speed."""
    ud, uv, slope = 0.2, 0.5, radians(25.0)
    material = {"static_friction": ud, "dynamic_friction": ud, "viscous_friction": uv}
    model = on_floor(height=rest(slope), slope=slope, dissipation=1.0, **material)
    with Simulation(model, engine) as simulation:
        trajectory = simulation.run(8.0, accuracy=1e-9)
    along = trajectory.coordinates.index("along")
    assert trajectory.speeds[-1][along] == pytest.approx((tan(slope) - ud) / uv, rel=1e-6)
    # On the way there, v' = g (sin - cos (ud + uv v)) above the transition velocity.
    rate, most = GRAVITY * np.cos(slope) * uv, (tan(slope) - ud) / uv
    first, second = 50, 150
    v, w = trajectory.speeds[first][along], trajectory.speeds[second][along]
    assert log((most - v) / (most - w)) == pytest.approx(
        rate * (trajectory.times[second] - trajectory.times[first]), rel=1e-5
    )
