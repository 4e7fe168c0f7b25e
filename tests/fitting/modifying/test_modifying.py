"""Tests of `modify`: its options, operators of OpenSim, fitted paths and smooth contact."""

from __future__ import annotations

from pathlib import Path
from shutil import copy

import numpy as np
import pytest

pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")

import osimlite
from osimlite.errors import OsimliteError, SettingError, UnsupportedError
from osimlite.fitting.modifying.operators import process_model
from osimlite.fitting.modifying.path_fitting import fit_paths
from osimlite.fitting.modifying.words import modify
from osimlite.models.jumper import jumper
from osimlite.models.walkers import furthest_walker
from tests.cli.command import run


def test_words_are_done_in_their_order() -> None:
    model = jumper()
    model.controller_set.objects.clear()
    before = osimlite.to_text(model)
    changed = modify(model, replace=[("muscles", "none"), ("reserves", "100:0.5")])
    assert osimlite.to_text(model) == before
    reserves = list(changed.components(osimlite.CoordinateActuator))
    assert not list(changed.components(osimlite.Muscle)) and reserves
    assert {(item.optimal_force, item.min_control, item.max_control) for item in reserves} == {
        (100.0, -0.5, 0.5)
    }
    assert osimlite.validate(changed).ok


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("muscle", "degroote"),
            "unknown part 'muscle' to replace; did you mean 'muscles'",
        ),
        (
            ("muscles", "degrote"),
            "muscles cannot be replaced with 'degrote'; did you mean 'degroote'",
        ),
        (("joints", "mtp_r"), "write joints=weld:NAME"),
        (("joints", "weld:hipp_r"), "no joint 'hipp_r'"),
        (("reserves", "many"), "reserves expects a positive number"),
        (("reserves", "-1"), "reserves expects a positive number, found '-1'"),
    ],
)
def test_what_is_none_is_refused(words: tuple[str, str], message: str) -> None:
    with pytest.raises(OsimliteError, match=message):
        modify(jumper(), replace=[words])


def test_fitted_paths_are_what_they_are_said_to_be() -> None:
    """Compare lengths and moment arms in poses that were not used for the fit."""
    model = jumper()
    fitted = {item.path.name: item for item in fit_paths(model, poses=300)}
    changed = modify(model, replace=[("paths", "polynomial")])
    assert all(
        isinstance(item.geometry_path, osimlite.FunctionBasedPath)
        for item in changed.components(osimlite.Muscle)
    )
    old, new = osimlite.paths(model), osimlite.paths(changed)
    rng = np.random.default_rng(3)
    infos = old.mechanism.coordinates
    off = []
    for _ in range(20):
        q = [
            info.default_value if info.range[1] > 5 else rng.uniform(*info.range) for info in infos
        ]
        lengths, others = old.lengths(np.array(q)), new.lengths(np.array(q))
        off += [
            abs(lengths[name] - others[name]) / max(fitted[name].worst_length, 1e-4)
            for name in fitted
        ]
    assert max(off) < 3.0
    osimlite.simulate(changed, to=0.02, engine="compiled")


def test_contact_becomes_smooth() -> None:
    """In deep contact, both contact models give similar motions."""
    model = furthest_walker()
    for force in list(model.components(osimlite.HuntCrossleyForce)):
        if "Foot" not in force.name:
            model.force_set.objects.remove(force)
    changed = modify(model, contact="smooth")
    assert not list(changed.components(osimlite.HuntCrossleyForce))
    smooth = list(changed.components(osimlite.SmoothSphereHalfSpaceForce))
    assert len(smooth) >= 2 and osimlite.validate(changed).ok
    motions = [osimlite.simulate(item, to=0.3, engine="compiled") for item in (model, changed)]
    assert motions[0].values[-1] == pytest.approx(motions[1].values[-1], abs=0.05)


def test_a_muscle_of_another_kind_is_refused_by_name() -> None:
    model = jumper()
    muscle = next(iter(model.components(osimlite.Muscle)))
    place = model.force_set.objects.index(muscle)
    other = osimlite.RigidTendonMuscle(
        name=muscle.name, geometry_path=muscle.geometry_path.copy_deep()
    )
    model.force_set.objects[place] = other
    with pytest.raises(UnsupportedError, match=rf"'{muscle.name}' is a RigidTendonMuscle"):
        modify(model, muscles="degroote")


def test_the_model_of_a_study_is_made(tmp_path: Path) -> None:
    osimlite.write(jumper(), tmp_path / "jumper.osim")
    processor = osimlite.ModelProcessor(
        name="model", filepath="jumper.osim", operators=[osimlite.ModOpIgnoreTendonCompliance()]
    )
    osimlite.write(osimlite.MocoTrack(name="track", model=processor), tmp_path / "study.omoco")
    done = run(
        "modify", "study.omoco", "--replace", "strength=2", "-o", "stiff.osim", folder=tmp_path
    )
    assert done.code == 0, done.err
    stiff, own = osimlite.read(tmp_path / "stiff.osim"), process_model(processor, tmp_path)
    for changed, before in zip(
        stiff.components(osimlite.Muscle), own.components(osimlite.Muscle), strict=True
    ):
        assert changed.ignore_tendon_compliance
        assert changed.max_isometric_force == 2.0 * before.max_isometric_force
    done = run("modify", "jumper.osim", "--replace", "muscles", folder=tmp_path)
    assert done.code == 2 and "NAME=WORD" in done.err
    with pytest.raises(SettingError):
        modify(own, paths="straight")


def test_the_command_says_what_each_replacement_changed(fixtures: Path, tmp_path: Path) -> None:
    """A replacement without an effect is visible: rigid tendons are set twice."""
    copy(fixtures / "labs" / "locked" / "leg.osim", tmp_path)
    words = ("muscles=degroote", "tendon=rigid", "reserves=100", "tendon=rigid", "muscles=none")
    options = [part for word in words for part in ("--replace", word)]
    done = run("modify", "leg.osim", *options, folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines()[:5] == [
        "muscles=degroote: 4 Millard2012EquilibriumMuscle became DeGrooteFregly2016Muscle",
        "tendon=rigid: ignore_tendon_compliance of 4 components changed",
        "reserves=100: 4 CoordinateActuator added",
        "tendon=rigid: nothing changed",
        "muscles=none: 4 DeGrooteFregly2016Muscle removed",
    ]


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("strength=-2", "strength expects a positive number, found '-2'"),
        ("reserves=0", "reserves expects a positive number, found '0'"),
        ("width=much", "width expects a positive number, found 'much'"),
        ("joints=weld:kne", "the model has no joint 'kne'; did you mean 'knee'?"),
    ],
)
def test_replacements_without_meaning(fixtures: Path, tmp_path: Path, word: str, text: str) -> None:
    copy(fixtures / "labs" / "locked" / "leg.osim", tmp_path)
    done = run("modify", "leg.osim", "--replace", word, folder=tmp_path)
    assert done.code == 2 and text in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["leg.osim"]
