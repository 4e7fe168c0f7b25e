"""Check that every corpus model with a mechanism can be displayed in the viewer."""

from __future__ import annotations

import json

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.meshes.folders import MeshFolders
from osimlite.mechanics.multibody import build_mechanism
from osimlite.view.collect import build_scene
from osimlite.view.page import page_data


def test_a_page_can_be_made(corpus_model) -> None:
    try:
        model = osimlite.read(corpus_model.path)
        mechanism = build_mechanism(model)
        q = mechanism.assemble({})
    except OsimliteError as error:
        pytest.skip(f"no mechanism: {error.message}")
    scene = build_scene(model, mechanism, MeshFolders(corpus_model.path.parent))
    data = page_data(model, scene, None, (), q)
    assert json.loads(json.dumps(data, allow_nan=False))["tree"]
    assert data["size"] > 0.0 and np.isfinite(data["center"]).all()
    # Parts that are not drawn are missing mesh files, or unsupported shapes and frames.
    for path, said in scene.remarks:
        assert path and any(
            word in said
            for word in ("mesh file", "does not draw", "polygons", "names no", "no such")
        )
