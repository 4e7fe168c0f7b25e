"""Tests of the registry of objects that sweeps use by name."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from osimlite.errors import SettingError
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.measures import RunMeasure, make_measure
from osimlite.studies.sweep.optimize import Objective


def test_a_measure_is_there_as_soon_as_it_is_registered(walker, monkeypatch):
    everything = {name: registry.find_measure(name) for name in registry.list_measure_names()}
    monkeypatch.setattr(registry, "MEASURES", everything)

    @registry.register_measure(is_maximized=True)
    def lightness(engine, feet):
        return RunMeasure("lightness", lambda batch: -np.ones(len(batch.starts)))

    assert make_measure("lightness", None).name == "lightness"
    assert Objective("lightness").sign == Objective("distance").sign != Objective("energy").sign
    with pytest.raises(SettingError, match="did you mean 'lightness'"):
        make_measure("lightnes", None)


def test_generic_sweeps_load_nothing_of_walkers():
    program = (
        "import sys; from osimlite.studies.sweep.registry import find_measure;"
        "from osimlite.studies.sweep import variants, runner;"
        "assert find_measure('distance') and find_measure('max(x)') is None;"
        "assert not [name for name in sys.modules if name.startswith('osimlite.studies.gait')];"
        "assert find_measure('steps').make.__module__ == 'osimlite.studies.gait.measures'"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_all_measures_are_known():
    assert set(registry.list_measure_names()) >= {
        "distance", "energy", "largest_force", "progress", "scuffs", "steps", "time_to_fall",
    }  # fmt: skip
