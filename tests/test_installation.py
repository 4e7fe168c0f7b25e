"""Tests of the dependencies: pip finds a wheel for each on common machines, and never has to compile PyBullet."""

from __future__ import annotations

from importlib import metadata

import pytest
from packaging.requirements import Requirement

HERE = {"sys_platform": "linux", "platform_machine": "x86_64", "python_version": "3.11"}
MAC = {**HERE, "sys_platform": "darwin", "platform_machine": "arm64"}
OLD_MAC = {**HERE, "sys_platform": "darwin"}
WINDOWS = {**HERE, "sys_platform": "win32", "platform_machine": "AMD64"}
ARM = {**HERE, "platform_machine": "aarch64"}


def asked(extra: str, machine: dict[str, str], python: str) -> list[Requirement]:
    """Return the requirements of `osimlite[extra]` on a machine with these environment markers."""
    there = {
        **machine,
        "python_version": python,
        "python_full_version": f"{python}.1",
        "extra": extra,
    }
    wanted = map(Requirement, metadata.requires("osimlite") or [])
    return [item for item in wanted if item.marker is None or item.marker.evaluate(there)]


def names(extra: str, machine: dict[str, str], python: str) -> set[str]:
    return {item.name for item in asked(extra, machine, python)}


@pytest.mark.parametrize("extra", ["all", "dev"])
def test_pybullet_comes_where_it_has_a_wheel(extra: str) -> None:
    assert "pybullet" in names(extra, HERE, "3.11")
    for machine, python in [
        (HERE, "3.12"),
        (HERE, "3.13"),
        (HERE, "3.14"),
        *((m, "3.11") for m in (MAC, WINDOWS, ARM)),
    ]:
        assert "pybullet" not in names(extra, machine, python)
        assert {"numpy", "numba"} <= names(extra, machine, python)


def test_opensim_comes_where_it_has_a_wheel() -> None:
    for machine, python in [(HERE, "3.11"), (HERE, "3.13"), (WINDOWS, "3.12")]:
        assert "opensim" in names("dev", machine, python)
    for machine, python in [(HERE, "3.14"), (MAC, "3.12"), (ARM, "3.12")]:
        assert "opensim" not in names("dev", machine, python)
    assert "opensim" not in names("all", HERE, "3.11")


def test_rerun_comes_where_it_has_a_wheel() -> None:
    assert "rerun-sdk" in names("dev", MAC, "3.13") and "rerun-sdk" not in names(
        "dev", OLD_MAC, "3.13"
    )


def test_who_asks_for_pybullet_gets_it() -> None:
    for machine, python in [(HERE, "3.11"), (HERE, "3.13"), (MAC, "3.12")]:
        assert {"pybullet", "numpy"} <= names("bullet", machine, python)


def test_numba_for_old_macs_is_the_last_with_wheels() -> None:
    (only,) = [item for item in asked("jit", OLD_MAC, "3.12") if item.name == "numba"]
    assert not only.specifier.contains("0.63") and only.specifier.contains("0.62.1")
    assert "numba" not in names("jit", OLD_MAC, "3.14")


def test_simulations_need_no_numba() -> None:
    assert names("sim", HERE, "3.12") >= {"numpy", "scipy"} and "numba" not in names(
        "sim", HERE, "3.12"
    )


def test_the_older_name_of_sim() -> None:
    assert names("fast", HERE, "3.12") == names("sim", HERE, "3.12")
