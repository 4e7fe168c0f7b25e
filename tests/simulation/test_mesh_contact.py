"""Tests of motions of meshes on an elastic foundation, and of the search for mesh files."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.view.model_view import ModelView
from tests.simulation.support import thrown


def test_energy_on_a_plane_is_kept_without_dissipation(tmp_path):
    model = thrown(tmp_path)
    model.force_set.objects[0].contact_parameters.objects[0].geometry = ("floor", "shell")
    trajectory = osimlite.simulate(model, 0.6, accuracy=1e-9, folder=tmp_path)
    total, stored = trajectory.energy["total"], trajectory.energy["stored"]
    assert stored.max() > 0.5
    assert np.ptp(total) < 1e-6 * stored.max()


def test_a_force_that_is_switched_off_does_nothing(tmp_path):
    model = thrown(tmp_path)
    model.force_set.objects[0].appliesForce = False
    assert not osimlite.simulate(model, 0.01, folder=tmp_path).forces


@pytest.mark.full
def test_fixed_steps_converge_at_first_order(tmp_path):
    model = thrown(tmp_path, dissipation=0.5, friction=0.5)
    best = osimlite.simulate(model, 0.2, accuracy=1e-9, folder=tmp_path)
    first = best.summary["contact_events"][0]
    assert first["contact"] == "contact (shell, stone)" and first["time_s"] < 0.15
    coarse, fine = (
        np.abs(
            osimlite.simulate(model, 0.2, fixed_step=step, folder=tmp_path).values[-1]
            - best.values[-1]
        ).max()
        for step in (4e-4, 2e-4)
    )
    assert coarse / fine == pytest.approx(2.0, rel=0.2)
    assert fine < 1e-2


def test_where_mesh_files_are(tmp_path, monkeypatch):
    model = thrown(tmp_path)
    with pytest.raises(
        ModelError,
        match=r"the mesh file 'stone\.obj' does not exist; put it beside the model's file",
    ):
        osimlite.simulate(model, 0.01)
    monkeypatch.chdir(tmp_path)
    osimlite.simulate(model, 0.01)
    inner = tmp_path / "models"
    inner.mkdir()
    osimlite.write(model, inner / "thrown.osim")
    (inner / "Geometry").mkdir()
    for name in ("egg.obj", "stone.obj"):
        (tmp_path / name).rename(inner / "Geometry" / name)
    words = [
        sys.executable,
        "-m",
        "osimlite",
        "simulate",
        "models/thrown.osim",
        "--to",
        "0.02",
        "-o",
        "out",
    ]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_recording_is_shown_with_the_forces_on_its_meshes(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    model = thrown(inner)
    osimlite.write(model, inner / "thrown.osim")
    trajectory = osimlite.simulate(model, 0.15, folder=inner)
    trajectory.to_sto(tmp_path / "states.sto")
    shown = ModelView.from_model(model, file=inner / "thrown.osim", motion=tmp_path / "states.sto")
    assert shown.motion is not None
    label = "contact.egg.force.Y"
    assert shown.motion.forces[label] == pytest.approx(trajectory.forces[label], abs=1e-6)
    assert trajectory.forces[label].max() > 1.0
