"""Tests of the files that setups name, directly or through other files."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import MissingFileError
from osimlite.tools.named_files import find_named_files


def write_setup(folder: Path, name: str, loads: str) -> str:
    path = folder / name
    osimlite.write(
        osimlite.InverseDynamicsTool(
            name="id",
            model_file="model.osim",
            coordinates_file="motion.mot",
            external_loads_file=loads,
            results_directory="results",
            output_gen_force_file="forces.sto",
        ),
        path,
    )
    return str(path)


def names(setup: str, rule: str = "file") -> list[str]:
    return [os.path.basename(path) for path in find_named_files(setup, rule)]


def test_what_a_named_document_names_is_named_too(tmp_path: Path) -> None:
    osimlite.write(osimlite.ExternalLoads(name="loads", datafile="plates.mot"), tmp_path / "l.xml")
    setup = write_setup(tmp_path, "id.xml", "l.xml")
    assert sorted(names(setup)) == ["l.xml", "model.osim", "motion.mot", "plates.mot"]
    # The second call uses the cache.
    assert sorted(names(setup)) == ["l.xml", "model.osim", "motion.mot", "plates.mot"]
    # Depending on the tool, results are next to the setup or in its folder of results.
    results = [*find_named_files(setup, "output-file")]
    assert results[:2] == [str(tmp_path / "forces.sto"), str(tmp_path / "results" / "forces.sto")]
    assert all(
        os.path.dirname(path) in (str(tmp_path), str(tmp_path / "results")) for path in results
    )


def test_setups_that_name_each_other_are_read_once(tmp_path: Path) -> None:
    one = write_setup(tmp_path, "one.xml", "other.xml")
    write_setup(tmp_path, "other.xml", "one.xml")
    assert sorted(names(one)) == sorted(
        ["model.osim", "motion.mot", "other.xml", "model.osim", "motion.mot", "one.xml"]
    )


def test_a_missing_setup_is_an_error_and_a_model_names_nothing(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="no such file"):
        names(str(tmp_path / "none.xml"))
    osimlite.write(osimlite.Model(name="m"), tmp_path / "model.osim")
    assert names(str(tmp_path / "model.osim")) == []
