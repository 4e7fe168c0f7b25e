"""Real models whose joints are all known: poses and mass matrices against OpenSim's, to the digits on record."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

from osimlite.document.reader import read_text
from osimlite.errors import UnsupportedError
from osimlite.multibody import build_mechanism
from osimlite.multibody.joints import MOTIONS

_TYPES = (None, "rotational", "translational", "coupled")


def _computable(truth) -> bool:
    """Whether the model has nothing but joints that we know."""
    kinds = {kind for path, kind in truth["components"]}
    constrained = any(path.startswith("/constraintset/") for path, kind in truth["components"])
    prescribed = any(item["prescribed"] for item in truth["coordinates"])
    joints = all(item["cls"] in MOTIONS for item in truth["joints"])
    return joints and not constrained and not prescribed and "StationDefinedFrame" not in kinds


def test_real_models_stand_as_in_opensim(corpus_model):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()).decode())
    if not _computable(truth):
        with pytest.raises(UnsupportedError):
            build_mechanism(model)
        return
    mechanism = build_mechanism(model)
    assert [info.path for info in mechanism.coordinates] == [item["path"] for item in truth["coordinates"]]
    assert [_TYPES.index(info.motion_type) for info in mechanism.coordinates] == [
        item["motion"] for item in truth["coordinates"]
    ]
    assert mechanism.total_mass == pytest.approx(truth["total_mass"], rel=1e-11, abs=1e-15)
    tree_order = [place for body in mechanism.bodies for place in body.mobilizer.coordinates]
    for pose in (truth["default_pose"], truth["pose2"]):
        q = np.array(pose["q"])
        for path, (position, rotation) in pose["body_xform"].items():
            found = mechanism.frame_transform(path, q)
            assert found[:3, 3] == pytest.approx(np.array(position), abs=1e-10)
            assert found[:3, :3].ravel() == pytest.approx(np.array(rotation), abs=1e-10)
        assert mechanism.center_of_mass(q) == pytest.approx(np.array(pose["com"]), abs=1e-10)
        if pose.get("mass_matrix"):
            found = mechanism.mass_matrix(q)[np.ix_(tree_order, tree_order)]
            expected = np.array(pose["mass_matrix"])
            assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_some_real_models_are_computed(corpus):
    truths = [json.loads(gzip.decompress(model.truth.read_bytes())) for model in corpus if model.converted]
    assert sum(map(_computable, truths)) >= 13
