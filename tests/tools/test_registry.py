"""Tests of the tables of tools and analyses: their functions exist, and their classes are OpenSim's."""

from __future__ import annotations

import pytest

from osimlite.schema.registry import MODULES
from osimlite.tools.registry import ANALYSES, TOOLS, import_function
from osimlite.tools.running import list_runnable


@pytest.mark.parametrize("path", [*TOOLS.values(), *ANALYSES.values()])
def test_every_entry_names_a_function(path: str) -> None:
    assert callable(import_function(path))


@pytest.mark.parametrize("table", [TOOLS, ANALYSES])
def test_every_entry_has_the_name_of_a_class_of_the_schema(table: dict[str, str]) -> None:
    assert [name for name in table if name not in MODULES] == []


def test_no_function_carries_out_two_classes() -> None:
    paths = [*TOOLS.values(), *ANALYSES.values()]
    assert len({*paths}) == len(paths)


def test_all_tools_of_the_table_can_be_run() -> None:
    assert sorted(list_runnable()) == sorted(TOOLS)
