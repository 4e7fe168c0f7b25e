"""Compare lengths, speeds and moment arms of all paths of corpus models with a live OpenSim 4.6.

OSIMLITE_POSES sets the number of poses per model.
"""

from __future__ import annotations

import gzip
import os

import pytest

import osimlite

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.opensim_paths import compare_paths  # noqa: E402


def test_real_paths(corpus_model, tmp_path, monkeypatch):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    # OpenSim keeps six digits of the numbers of old files. Its print has the same digits for both
    # programs.
    file = tmp_path / "model.osim"
    file.write_bytes(gzip.decompress(corpus_model.converted.read_bytes()))
    if not osimlite.paths(osimlite.read(file)).names:
        pytest.skip("there are no paths")
    compare_paths(file, poses=int(os.environ.get("OSIMLITE_POSES", "1")))
