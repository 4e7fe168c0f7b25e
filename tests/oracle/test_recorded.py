"""Compare inverse dynamics of recorded motions with a live OpenSim's InverseDynamicsTool."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite import Body, Coordinate, Model, SpringGeneralizedForce
from osimlite.io.document.reader import read_text
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation.elements import force_elements
from osimlite.simulation.recorded_motion import RecordedMotion, exclude_forces
from tests.oracle.opensim_runs import inverse_dynamics

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle


def recorded(corpus: Any, name: str, times: Any, noise: float = 0.0) -> Any:
    """Write a corpus model and a motion of it into the current folder; return its mechanism.

    Args:
        corpus: models of the corpus.
        name: identifier of the model.
        times: times of the motion (s).
        noise: standard deviation of noise on the coordinates (rad or m).
    """
    converted = next(model.converted for model in corpus if model.id == name)
    text = gzip.decompress(converted.read_bytes()).decode()
    Path("model.osim").write_text(text)
    mechanism = build_mechanism(read_text(text), opensim_derivatives=True)
    values = np.array(
        [0.2 * np.sin(3.0 * times + index) for index in range(len(mechanism.coordinates))]
    ).T
    values += mechanism.values({}) + noise * np.random.default_rng(3).normal(size=values.shape)
    turned = [info.motion_type == "rotational" for info in mechanism.coordinates]
    degrees = np.where(turned, np.degrees(values), values)
    write_sto(
        "motion.mot", "motion", times, mechanism.coordinate_names, degrees.tolist(), in_degrees=True
    )
    return mechanism


@pytest.mark.parametrize("name", ["m0005", "m0013", "m0954"])
def test_inverse_dynamics_of_real_models(
    corpus: Any, name: str, tmp_path: Path, monkeypatch: Any, capfd: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    mechanism = recorded(corpus, name, np.linspace(0.0, 1.0, 250))
    theirs = inverse_dynamics("model.osim", "motion.mot")
    capfd.readouterr()
    ours = RecordedMotion.read(mechanism, "motion.mot").inverse_dynamics()
    assert ours.columns == theirs.columns
    assert ours.times == pytest.approx(theirs.times, abs=1e-8)
    assert np.abs(ours.rows - theirs.rows).max() < 1e-8 * np.abs(theirs.rows).max()


def _pushed(model: Model) -> None:
    """Add springs, a path spring and stops to a model, some of them disabled.

    The motion nevertheless moves the coordinates that are locked.
    """
    for index, coordinate in enumerate(model.components(Coordinate)):
        model.add(
            SpringGeneralizedForce(
                name=f"s{index}", coordinate=coordinate.name, stiffness=3.0, viscosity=0.5
            )
        )
        coordinate.locked = index % 3 == 1
    tips = list(model.components(Body))
    ends = [
        osimlite.PathPoint(name=tip.name, socket_parent_frame=tip, location=(0.1, 0.0, 0.0))
        for tip in tips[-2:]
    ]
    cord = model.add(
        osimlite.PathSpring(name="cord", resting_length=0.01, stiffness=100.0, dissipation=0.1)
    )
    cord.geometry_path.path_point_set.objects[:] = ends
    model.find("/forceset/s2").appliesForce = False


@pytest.mark.parametrize("name", ["m0005", "m0014"])
def test_inverse_dynamics_beyond_the_forces_of_the_model(
    corpus: Any, name: str, tmp_path: Path, monkeypatch: Any, capfd: Any
) -> None:
    """Only muscles are excluded, as OpenSim's setup files usually do by `forces_to_exclude`."""
    monkeypatch.chdir(tmp_path)
    recorded(corpus, name, np.linspace(0.0, 1.0, 60))
    model = osimlite.read("model.osim")
    _pushed(model)
    osimlite.write(model, "model.osim")
    theirs = inverse_dynamics("model.osim", "motion.mot", exclude="Muscles")
    capfd.readouterr()
    mechanism = build_mechanism(model, opensim_derivatives=True)
    motion = RecordedMotion.read(mechanism, "motion.mot")
    alone = motion.inverse_dynamics()
    exclude_forces(model, ["muscles"])
    ours = motion.inverse_dynamics(force_elements(model, mechanism))
    assert ours.columns == theirs.columns
    assert np.abs(ours.rows - theirs.rows).max() < 1e-8 * np.abs(theirs.rows).max() + 1e-8
    assert np.abs(ours.rows - alone.rows).max() > 1.0


# Times with uneven steps (s).
UNEVEN = np.sort(np.r_[np.linspace(0.0, 1.0, 41), 0.013, 0.4801, 0.777])
# Times that are rounded to microseconds, as in files (s).
DECIMAL = np.round(np.arange(151) / 150.0, 6)


@pytest.mark.parametrize(
    ("times", "cutoff"),
    [
        (np.arange(65) / 64.0, 6.0),
        (np.arange(101) * 0.01, 6.0),
        (DECIMAL, 15.0),
        (UNEVEN, 6.0),
        (np.arange(601) / 600.0, 2.5),
        (np.array([0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0]), 2.0),
    ],
    ids=["even", "hundredths", "rounded", "uneven", "many", "few"],
)
@pytest.mark.parametrize("name", ["m0005", "m0013"])
def test_inverse_dynamics_through_the_filter(
    corpus: Any, name: str, times: Any, cutoff: float, tmp_path: Path, monkeypatch: Any, capfd: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    mechanism = recorded(corpus, name, times, noise=1e-3)
    theirs = inverse_dynamics("model.osim", "motion.mot", to=2.0, lowpass=cutoff)
    capfd.readouterr()
    ours = RecordedMotion.read(mechanism, "motion.mot").apply_lowpass(cutoff).inverse_dynamics()
    assert ours.columns == theirs.columns
    # OpenSim's table includes the times by which the filter extends the data.
    same = np.abs(theirs.times[:, None] - ours.times).argmin(axis=0)
    assert theirs.times[same] == pytest.approx(ours.times, abs=1e-8)
    # OpenSim prints eight decimals.
    allowed = 1e-8 * np.abs(theirs.rows).max(axis=0) + 0.51e-8
    assert (np.abs(ours.rows - theirs.rows[same]).max(axis=0) / allowed).max() <= 1.0
    step = ours.times[1] - ours.times[0]
    assert abs(ours.times[0] - times[0]) < step and abs(ours.times[-1] - times[-1]) < step
