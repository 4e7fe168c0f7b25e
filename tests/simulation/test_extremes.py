"""Tests of extreme numbers in models: every engine gives the same verdict, a motion or a clear error."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import osimlite
from osimlite import to_text
from osimlite.errors import ModelError, OsimliteError, SettingError, SimulationError
from tests.simulation.force_cases import FORCES, with_force
from tests.suite import choose

NUMBERS = re.compile(r"<(\w+)>([-+0-9.eE \n\t]*\d[-+0-9.eE \n\t]*)</\1>")
EXTREMES = (
    "1e308",
    "-1e308",
    "1e160",
    "-1e160",
    "1e16",
    "1e-160",
    "1e-320",
    "-1e-320",
    "0",
    "-1",
    "nan",
    "inf",
    "-inf",
)


def verdict(model, engine, **how):
    try:
        motion = osimlite.simulate(model, 1e-6, engine, **how)
    except OsimliteError as error:
        assert "\n" not in str(error)
        return str(error)
    motion.forces_text()
    assert np.isfinite(motion.values).all()
    return "a motion"


def pendulum(joint, **body):
    given = {"mass": 1.0, "mass_center": (0, -0.1, 0), "inertia": (1, 1, 1, 0, 0, 0), **body}
    model = osimlite.Model(name="pendulum")
    bob = model.add(osimlite.Body(name="bob", **given))
    model.add(joint(name="joint").between(model.ground, bob))
    return model


@pytest.mark.parametrize("joint", [osimlite.PinJoint, osimlite.FreeJoint])
@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"inertia": (-1,) * 6}, "a negative inertia"),
        ({"inertia": (-1,) * 6, "mass_center": (0, 0, 0)}, "a negative inertia"),
        ({"inertia": (1e-320,) * 6, "mass_center": (0, 0, 0)}, "moves no mass"),
        ({"inertia": (0,) * 6, "mass_center": (0, 0, 0)}, "moves no mass"),
        ({"mass": 1e-320, "inertia": (1e-320,) * 3 + (0,) * 3}, "moves no mass"),
        ({"mass": 1e308}, "not finite"),
        ({"inertia": (1e308,) * 6}, "not finite"),
        ({"mass_center": (0, 1e308, 0)}, "not finite"),
        ({"inertia": (float("nan"),) * 6}, "not finite"),
    ],
)
def test_both_engines_refuse_an_inertia_that_no_body_has(joint, body, words):
    told = {verdict(pendulum(joint, **body), engine) for engine in ("bullet", "compiled")}
    assert len(told) == 1 and words in told.pop()


@pytest.mark.parametrize(
    ("field", "value", "kind", "words"),
    [
        (
            "translation",
            (float("inf"), 0, 0),
            ModelError,
            "has a position or orientation that is not finite",
        ),
        (
            "orientation",
            (0, float("nan"), 0),
            ModelError,
            "has a position or orientation that is not finite",
        ),
        ("translation", (1e308, 1e308, 0), SimulationError, "the positions of the frames"),
    ],
)
@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_a_frame_that_is_nowhere_is_refused(engine, field, value, kind, words):
    model = pendulum(osimlite.PinJoint)
    (joint,) = model.joint_set.objects
    frame = osimlite.PhysicalOffsetFrame(
        name="there", socket_parent="/bodyset/bob", **{field: value}
    )
    joint.frames.append(frame)
    joint.socket_child_frame = "/jointset/joint/there"
    with pytest.raises(kind, match=words):
        osimlite.simulate(model, 0.01, engine)


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
@pytest.mark.parametrize("step", [1e-300, 5e-324, 1e-15])
def test_a_fixed_step_that_never_arrives_is_refused(engine, step):
    with pytest.raises(SettingError, match="more than a billion steps; use longer ones"):
        osimlite.simulate(pendulum(osimlite.PinJoint), 1.0, engine, fixed_step=step)


@settings(max_examples=choose(5, 15), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_any_number_gets_one_verdict(data):
    name = data.draw(st.sampled_from(sorted(FORCES)))
    text = to_text(with_force(FORCES[name]))
    leaf = data.draw(st.sampled_from(list(NUMBERS.finditer(text))))
    words, extreme = leaf[2].split(), data.draw(st.sampled_from(EXTREMES))
    # With a mass centre at 1e16 m, the body's own inertia is a rounding error, and so is the sign
    # of the sum.
    assume(not (extreme == "1e16" and leaf[0].startswith("<mass_center>")))
    places = data.draw(
        st.sampled_from([[place] for place in range(len(words))] + [list(range(len(words)))])
    )
    for place in places:
        words[place] = extreme
    try:
        model = osimlite.read_text(text[: leaf.start(2)] + " ".join(words) + text[leaf.end(2) :])
    except OsimliteError:
        return
    told = [verdict(model, engine) == "a motion" for engine in ("bullet", "compiled")]
    assert told[0] == told[1]
    for engine in ("bullet", "compiled"):
        verdict(model, engine, fixed_step=1e-6)


def test_a_station_that_is_nowhere_is_no_matter():
    model = pendulum(osimlite.PinJoint)
    model.add(
        osimlite.Station(
            name="toe", location=(float("inf"), 0.0, 0.0), socket_parent_frame=model.ground
        )
    )
    assert osimlite.simulate(model, 0.01, "compiled").times[-1] == 0.01


def test_steps_that_lead_nowhere_come_to_an_end():
    """Each step is as short as the range of numbers permits, so without a limit their number would be endless."""
    model = pendulum(osimlite.PinJoint)
    coordinate = next(iter(model.components(osimlite.Coordinate)))
    words = "1e40*sin(1e30*q)"
    model.add(
        osimlite.ExpressionBasedCoordinateForce(
            name="drive", coordinate=coordinate, expression=words
        )
    )
    with pytest.raises(SimulationError, match="cannot continue at t = "):
        osimlite.simulate(model, 1e-6, "compiled", initial={coordinate.name: 1.0})
