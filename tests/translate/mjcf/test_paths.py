"""Tendons, in MuJoCo's own eyes, against the paths of the model."""

from __future__ import annotations

import numpy as np

import osimlite
from osimlite.translate import to_mjcf
from osimlite.translate.mjcf.poses import random_values
from tests.translate.mjcf.compiled import Compiled

POSES = 30


def errors(model, **options):
    """What is wrong with the length of each tendon (P,), m, by name, in poses of their own."""
    mjcf = to_mjcf(model, visuals=False, **options)
    compiled, paths = Compiled(mjcf), osimlite.paths(model)
    found = {name.rpartition("/")[2]: [] for name in paths.names}
    for q in random_values(paths.mechanism, POSES, 5):
        compiled.place(q)
        for name, length in paths.lengths(q).items():
            muscle = name.rpartition("/")[2]
            found[muscle].append(compiled.data.tendon(muscle).length[0] - length)
    return mjcf, {name: np.array(row) for name, row in found.items()}


def of(corpus, number):
    return osimlite.read(next(item.path for item in corpus if item.id == number))


def test_lengths_are_off_by_what_fidelity_says(corpus):
    mjcf, found = errors(of(corpus, "m0005"))
    said = {
        record.detail.removeprefix("tendon "): record.errors["length"]
        for record in mjcf.fidelity
        if record.kind == "path"
    }
    assert {"iliopsoas_r", "rect_fem_r", "vasti_l"} <= said.keys()
    assert "soleus_r" not in said
    for name, off in found.items():
        if name in said:
            assert np.sqrt(np.mean(off**2)) < 2.0 * said[name].rms + 1e-6
        else:
            assert np.abs(off).max() < 1e-9


def test_points_that_come_and_go_are_where_openSim_has_them(corpus):
    _, found = errors(of(corpus, "m0005"))
    for name in ("iliopsoas_r", "iliopsoas_l", "gastroc_r", "gastroc_l"):
        assert np.abs(found[name]).max() < 2e-5


def test_a_locked_coordinate_moves_no_point(corpus):
    model = of(corpus, "m0005")
    knee = model["/jointset/knee_r/knee_angle_r"]
    knee.locked, knee.default_value = True, -1.0
    _, found = errors(model)
    assert np.abs(found["vasti_r"]).max() < 3e-4
    assert np.abs(found["soleus_r"]).max() < 1e-9
