"""Tests of `static_optimization` on small models with known solutions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import (
    DeprecatedWarning,
    ModelError,
    OsimliteError,
    SettingError,
    UnsupportedError,
)
from osimlite.io.tables.storage import read_sto
from tests.simple_models import make_slide
from tests.suite import choose

TIMES = np.linspace(0.0, 1.0, 51)
UP = 0.5 * TIMES**2
NEEDED = 2.0 * (1.0 + 9.80665)


def lift(*strengths: float) -> osimlite.Model:
    """Return a body of 2 kg that moves upwards, with actuators of these strengths (N)."""
    # The slider runs along its x axis, which is turned upwards.
    return make_slide(
        *(actuator(f"a{number}", strength) for number, strength in enumerate(strengths)),
        coordinate="y",
        name="lift",
        mass=2.0,
        turned=(0.0, 0.0, 0.5 * np.pi),
    )


def bounded(low: float, high: float) -> osimlite.Model:
    model = lift(1.0)
    model.force_set.objects[0].min_control, model.force_set.objects[0].max_control = low, high
    return model


def actuator(name: str, strength: float, **more: float) -> osimlite.CoordinateActuator:
    return osimlite.CoordinateActuator(name=name, coordinate="y", optimal_force=strength, **more)


@pytest.mark.parametrize("exponent", [1.5, 2.0, 3.0, 10.0])
def test_the_shares_are_those_of_the_strengths(exponent: float) -> None:
    """Without bounds, forces are proportional to the strengths to the power of 1 / (p - 1)."""
    found = osimlite.static_optimization(
        lift(30.0, 10.0), {"y": UP}, times=TIMES, exponent=exponent
    )
    shares = np.array([30.0, 10.0]) ** (1.0 / (exponent - 1.0))
    expected = NEEDED * shares / (shares @ [30.0, 10.0])
    assert found.solved.all() and found.describe_unsolved() == ""
    assert found.rows == pytest.approx(np.tile(expected, (51, 1)), rel=1e-6)
    assert found.forces is not None and found.forces.rows.sum(axis=1) == pytest.approx(
        np.full(51, NEEDED), rel=1e-9
    )
    assert found.columns == found.forces.columns == ("a0", "a1")
    assert list(found.to_frame()) == ["a0", "a1"]


def test_one_actuator_bounds_and_forces_from_files(tmp_path: Path) -> None:
    only = osimlite.static_optimization(lift(5.0), {"y": UP}, times=TIMES)
    assert only.rows == pytest.approx(np.full((51, 1), NEEDED / 5.0), rel=1e-9)
    reserves = osimlite.ForceSet(name="reserves")
    reserves.objects.append(actuator("reserve", 1.0, min_control=0.0, max_control=2.0))
    osimlite.write(reserves, tmp_path / "reserves.xml")
    found = osimlite.static_optimization(
        lift(30.0), {"y": UP}, times=TIMES, forces=[tmp_path / "reserves.xml"]
    )
    assert found.columns == ("a0", "reserve")
    other = osimlite.static_optimization(
        lift(30.0), {"y": UP}, times=TIMES, forces=reserves.objects, replace_forces=True
    )
    # Two newtons are the limit of the reserve.
    assert other.columns == ("reserve",)
    assert not other.solved.any() and np.isnan(other.rows).all()
    assert "no solution at 51 of 51 times (first at 0 s)" in (said := other.describe_unsolved())
    assert "the actuators lack 19.61 N at y" in said
    with pytest.warns(DeprecatedWarning, match="use describe_unsolved"):
        assert other.unsolved() == said
    off = lift(30.0, 10.0)
    off.force_set.objects[1].appliesForce = False
    assert osimlite.static_optimization(off, {"y": UP}, times=TIMES).columns == ("a0",)


def test_files_have_the_names_of_the_analysis(tmp_path: Path) -> None:
    found = osimlite.static_optimization(lift(30.0, 10.0), {"y": UP}, times=TIMES)
    names = [
        "StaticOptimization_activation.sto",
        "StaticOptimization_force.sto",
        "StaticOptimization_controls.xml",
    ]
    assert [path.name for path in found.write(tmp_path / "out")] == names
    assert read_sto(tmp_path / "out" / names[0]).rows.tolist() == found.rows.tolist()
    controls = osimlite.read_document(tmp_path / "out" / names[2])
    assert [curve.name for curve in controls.objects] == ["a0", "a1"]


@pytest.mark.parametrize(
    ("model", "more", "error", "said"),
    [
        (lift(), {}, ModelError, "'lift' has no actuators"),
        (
            lift(1.0),
            {"exponent": 1.0},
            SettingError,
            "an exponent of 1 does not determine the activations",
        ),
        (lift(1.0), {"exponent": np.nan}, SettingError, "an exponent of nan"),
        (lift(1.0), {"muscles": "strong"}, SettingError, "unknown muscle force 'strong'"),
        (lift(1.0), {"start": 3.0}, SettingError, "the motion has no row"),
        (lift(1.0), {"forces": ["nothing.xml"]}, OsimliteError, "nothing.xml"),
        (bounded(np.inf, np.inf), {}, ModelError, "only infinite controls, from inf to inf"),
        (bounded(1.0, 0.0), {}, ModelError, "a min_control of 1 above its max_control of 0"),
        (lift(1.0), {"applied_to": {"body": [["f_"]]}}, SettingError, "pass the table"),
    ],
)
def test_what_cannot_be_asked(
    model: osimlite.Model, more: dict, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        osimlite.static_optimization(model, {"y": UP}, times=TIMES, **more)


def test_what_has_no_single_control_is_refused() -> None:
    model = lift(1.0)
    model.add(osimlite.BodyActuator(name="push", socket_body=model.body_set.objects[0]))
    with pytest.raises(
        UnsupportedError, match="'push' is a BodyActuator, which does not have exactly one control"
    ):
        osimlite.static_optimization(model, {"y": UP}, times=TIMES)


def test_random_bounds_never_end_in_a_traceback() -> None:
    """All equations hold within the bounds, or the result is NaN; masses of 0 and useless actuators occur too."""
    rng = np.random.default_rng(7)
    solved = 0
    count = choose(60, 300)
    for number in range(count):
        strengths = rng.choice([0.0, 1e-6, 1.0, 30.0, -5.0], size=rng.integers(1, 4)).tolist()
        model = lift(*strengths)
        for item in model.force_set.objects:
            item.min_control, item.max_control = np.sort(
                rng.choice([-np.inf, -3.0, 0.0, 1.0, np.inf], size=2)
            ).tolist()
            if item.min_control == item.max_control and not np.isfinite(item.min_control):
                item.min_control, item.max_control = -np.inf, np.inf
        model.body_set.objects[0].mass = mass = float(rng.choice([0.0, 1e-3, 2.0]))
        power = float(rng.choice([1.2, 2.0, 3.0]))
        found = osimlite.static_optimization(model, {"y": UP}, times=TIMES, exponent=power, end=0.0)
        low, high = np.array(
            [(item.min_control, item.max_control) for item in model.force_set.objects]
        ).T
        if found.solved[0]:
            solved += 1
            assert (low <= found.rows[0]).all() and (found.rows[0] <= high).all(), number
            needed = mass * (1.0 + 9.80665)
            assert found.forces is not None and found.forces.rows[0].sum() == pytest.approx(
                needed, rel=1e-9, abs=1e-9
            ), number
        else:
            assert np.isnan(found.rows[0]).all() and "at y" in found.describe_unsolved(), number
    assert count / 6 < solved < 5 * count / 6


def test_a_locked_coordinate_stays_where_it_is() -> None:
    """Neither its recorded motion nor the moment that it would need counts."""
    free = osimlite.static_optimization(lift(30.0), {"y": UP}, times=TIMES)
    model = lift(30.0)
    other = model.add(osimlite.Body(name="other", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    still = osimlite.Coordinate(name="still", locked=True)
    model.add(
        osimlite.PinJoint(
            name="k",
            socket_parent_frame=model.ground,
            socket_child_frame=other,
            coordinates=[still],
        )
    )
    found = osimlite.static_optimization(model, {"y": UP, "still": np.sin(TIMES)}, times=TIMES)
    assert found.solved.all() and found.rows == pytest.approx(free.rows, rel=1e-12)


def test_loads_of_another_class_are_named(tmp_path: Path) -> None:
    """Old documents contain PrescribedForces in ExternalLoads, which OpenSim refuses."""
    (tmp_path / "loads.xml").write_text(
        '<OpenSimDocument Version="20302"><ExternalLoads name=""><objects><PrescribedForce name="push"/></objects>'
        "</ExternalLoads></OpenSimDocument>"
    )
    with pytest.raises(
        OsimliteError, match="'push' is a PrescribedForce, which OpenSim refuses here"
    ):
        osimlite.static_optimization(lift(30.0), {"y": UP}, tmp_path / "loads.xml", times=TIMES)
