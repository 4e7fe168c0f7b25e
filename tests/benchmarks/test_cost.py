"""Tests of the cost counter: costs of everyday actions equal those in benchmarks/cost.json within 3 %."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks import cost
from benchmarks.cost import KINDS, Cost, describe_changes


def costs(**numbers: int) -> dict[str, Cost]:
    """Return the cost of an action.

    Args:
        numbers: number of calls of each function, such as `legs__step` for `step` in `legs.py`.

    Returns:
        Cost of the action `walk`, by action.
    """
    calls = {name.replace("__", ".py: "): number for name, number in numbers.items()}
    return {"walk": Cost({kind: calls if kind == "calls" else {} for kind in KINDS})}


def test_three_percent_more_calls_are_told_with_the_functions_that_make_them() -> None:
    old = costs(legs__step=1000, legs__others=30, arms__swing=950, others=20)
    new = costs(legs__step=1040, legs__lift=60, arms__swing=950, head__nod=30)
    assert describe_changes(old, new, same_versions=True) == [
        "walk costs more: 2,080 calls, before 2,000 (+4.0%)\n"
        "    +40 in legs.py: step, now 1,040\n"
        "    +30 in legs.py: others (most in legs.py: lift), now 60\n"
        "    +10 in others (most in head.py: nod), now 30"
    ]


def test_what_became_cheaper_is_told_too() -> None:
    (said,) = describe_changes(costs(legs__step=1000), costs(legs__step=900), same_versions=True)
    assert said.splitlines() == [
        "walk costs less: 900 calls, before 1,000 (-10.0%)",
        "    -100 in legs.py: step, now 900",
    ]


def test_less_than_three_percent_and_a_few_calls_are_nothing() -> None:
    assert not describe_changes(costs(legs__step=1000), costs(legs__step=1030), same_versions=True)
    assert not describe_changes(costs(legs__step=10), costs(legs__step=30), same_versions=True)


def test_modules_are_told_by_name() -> None:
    old, new = (
        {"walk": Cost({k: names if k == "modules" else {} for k in KINDS})}
        for names in ({"a": 1}, {"b": 1, "c": 1})
    )
    (said,) = describe_changes(old, new, same_versions=True)
    assert said.splitlines()[1:] == ["    loads b, c", "    no longer loads a"]


def test_libraries_are_compared_where_they_are_the_same() -> None:
    old, new = (
        {"walk": Cost({k: {"rich": n} if k == "library calls" else {} for k in KINDS})}
        for n in (1000, 2000)
    )
    assert describe_changes(old, new, same_versions=True)
    assert not describe_changes(old, new, same_versions=False)


def test_what_is_not_in_the_file_yet_is_told() -> None:
    assert describe_changes({}, costs(legs__step=1), same_versions=True) == [
        "walk has no accepted cost yet"
    ]


def test_the_file_holds_what_was_accepted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cost, "ACCEPTED_FILE", tmp_path / "cost.json")
    parts = {
        "calls": {"legs.py: step": 1000, "legs.py: lift": 5, "legs.py: drop": 7, "head.py: nod": 4},
        "modules": {"osimlite": 1, "osimlite.legs": 1},
        "data": {"walker.osim": 500},
        "code": {"osimlite": 100, "osimlite.legs": 200},
        "library calls": {"rich": 50},
        "library modules": {"rich": 3},
    }
    given = {"walk": Cost(parts), "run": Cost({**parts, "modules": {"osimlite": 1}})}
    cost.write_accepted(given)
    versions, read = cost.read_accepted()
    assert versions == cost.get_versions()
    assert {name: item.totals for name, item in read.items()} == {
        name: item.totals for name, item in given.items()
    }
    assert read["walk"].parts["calls"] == {
        "legs.py: step": 1000,
        "legs.py: others": 12,
        "others": 4,
    }
    assert read["walk"].parts["modules"] == parts["modules"]
    assert read["run"].parts["modules"] == {"osimlite": 1}
    assert not describe_changes(read, given, same_versions=True)


@pytest.mark.full
@pytest.mark.skipif(sys.platform != "linux", reason="counted on Linux")
@pytest.mark.skipif(not cost.ACCEPTED_FILE.exists(), reason="no costs are accepted yet")
def test_no_action_became_dearer() -> None:
    """Compare the measured costs with benchmarks/cost.json.

    To accept other costs, run `python benchmarks/cost.py --accept` and give the reason in the
    commit message.
    """
    for package in ("mujoco",):
        pytest.importorskip(package)
    versions, old = cost.read_accepted()
    said = describe_changes(
        old, cost.measure_costs(), same_versions=versions == cost.get_versions()
    )
    assert not said, "\n" + "\n".join(said) + "\nto accept this: python benchmarks/cost.py --accept"
