"""Inverse dynamics of recorded motions against OpenSim's InverseDynamicsTool, live."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from osimlite.document.reader import read_text
from osimlite.multibody import build_mechanism
from osimlite.simulation.recorded import RecordedMotion
from osimlite.simulation.storage import write_sto
from tests.oracle.opensim_runs import inverse_dynamics

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle


@pytest.mark.parametrize("name", ["m0005", "m0013", "m0954"])
def test_inverse_dynamics_of_real_models(corpus: Any, name: str, tmp_path: Path, monkeypatch: Any, capfd: Any) -> None:
    converted = next(model.converted for model in corpus if model.id == name)
    text = gzip.decompress(converted.read_bytes()).decode()
    monkeypatch.chdir(tmp_path)
    Path("model.osim").write_text(text)
    mechanism = build_mechanism(read_text(text), opensim_derivatives=True)
    times = np.linspace(0.0, 1.0, 250)
    values = np.array([0.2 * np.sin(3.0 * times + place) for place in range(len(mechanism.coordinates))]).T
    values += mechanism.values({})
    turned = [info.motion_type == "rotational" for info in mechanism.coordinates]
    degrees = np.where(turned, np.degrees(values), values)
    write_sto("motion.mot", "motion", times, mechanism.coordinate_names, degrees.tolist(), in_degrees=True)
    theirs = inverse_dynamics("model.osim", "motion.mot")
    capfd.readouterr()
    ours = RecordedMotion.read(mechanism, "motion.mot").inverse_dynamics()
    assert ours.columns == theirs.columns
    assert ours.times == pytest.approx(theirs.times, abs=1e-8)
    assert np.abs(ours.rows - theirs.rows).max() < 1e-8 * np.abs(theirs.rows).max()
