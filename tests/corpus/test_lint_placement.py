"""Compare the linter's positions of bodies in the default pose with OpenSim's."""

from __future__ import annotations

import gzip
import json

import pytest

from osimlite.io.document.source import Source
from osimlite.io.document.survey import survey_source
from osimlite.lint.placement import compute_default_poses
from osimlite.lint.subject import Subject
from osimlite.mechanics.laws.rotations import transpose_rotation
from osimlite.schema.frames import Body
from osimlite.schema.sets import Constraint
from tests.conftest import ROUNDED, CorpusModel


def test_default_poses_are_opensims(corpus_model: CorpusModel) -> None:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    subject = Subject(survey_source(Source(gzip.decompress(corpus_model.converted.read_bytes()))))
    if next(subject.find_instances(Constraint), None) is not None:
        pytest.skip("OpenSim assembles this model, which moves it")
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))["default_pose"][
        "body_xform"
    ]
    poses = compute_default_poses(subject)
    placed = [
        body
        for body in subject.find_instances(Body)
        if id(body) in poses and subject.path(body) in truth
    ]
    if not placed:
        pytest.skip("no body is placed by joints that can be followed without arrays")
    near = ROUNDED.get(corpus_model.id, 1e-10)
    for body in placed:
        pose = poses[id(body)]
        position, rotation = truth[subject.path(body)]
        assert pose.position == pytest.approx(position, abs=near), body.name
        numbers = [number for row in transpose_rotation(pose.axes) for number in row]
        assert numbers == pytest.approx(rotation, abs=near), body.name
