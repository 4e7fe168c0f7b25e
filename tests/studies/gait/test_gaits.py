"""Tests of the search for walkers with gait cycles, in narrow ranges around a known walker."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from osimlite.cli import create_app
from osimlite.errors import OsimliteError, SettingError, SimulationError, UnsupportedError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.walkers import STEADY_START, human_walker, steady_walker
from osimlite.schema.constraint_types import PointConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.simulation import Simulation
from osimlite.studies.sweep.plan import plan

pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")

from osimlite.studies.gait.cycle import find_cycle
from osimlite.studies.gait.cycle_search import CycleSearch, ModelCycle
from osimlite.studies.gait.gaits import find_gait
from osimlite.studies.gait.stability import StabilityOptimization
from osimlite.studies.gait.stepmap import StepMap
from tests.suite import choose

INERTIA, AHEAD = "/bodyset/*Shank/inertia/2", "/contactgeometryset/*FootContact/location/0"
JOINTS = [name for name in STEADY_START if not name.startswith("Pelvis")]
NEAR = {
    INERTIA: (0.085, 0.1),
    AHEAD: (0.065, 0.085),
    **{name: (STEADY_START[name][0] - 0.1, STEADY_START[name][0] + 0.1) for name in JOINTS},
    **{
        f"{name}/speed": (STEADY_START[name][1] - 0.4, STEADY_START[name][1] + 0.4)
        for name in JOINTS
    },
}
FEW = {"samples": choose(128, 256), "tries": 3, "enough": 1, "budget": 4}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("found")
    stages = []
    gait = find_gait(
        plan(dynamic_walker(), NEAR), folder, **FEW, stage=lambda *words: stages.append(words)
    )
    return gait, folder, stages


@pytest.mark.full
def test_a_walker_is_found_that_never_stops(found):
    gait, folder, stages = found
    assert gait.model_cycle.cycle.residual < 1e-9 and gait.model_cycle.cycle.largest < 1.0
    assert gait.walk.walks and len(gait.walk.steps) > 50 and not gait.walk.scuffs
    assert sorted({title for title, _, _ in stages}) == [
        "closing cycles",
        "making it stable",
        "random walkers",
    ]
    with Simulation(read(folder / "best.osim"), "compiled") as simulation:
        cycle = find_cycle(StepMap(simulation.engine, simulation.initial_state({}, {})))
    assert cycle.largest == pytest.approx(gait.model_cycle.cycle.largest, abs=1e-2)
    assert (cycle.length, cycle.period) == pytest.approx(
        (gait.model_cycle.cycle.length, gait.model_cycle.cycle.period), rel=1e-7
    )


@pytest.mark.full
def test_only_the_numbers_that_may_change_do_and_have_few_digits(found):
    gait, folder, _ = found
    before, after = dynamic_walker(), read(folder / "best.osim")
    assert {
        name: float(f"{number:.3g}") for name, number in gait.model_cycle.numbers.items()
    } == gait.model_cycle.numbers
    for body in ("LeftShank", "RightShank"):
        assert after[f"/bodyset/{body}"].inertia == (
            1.0,
            1.0,
            gait.model_cycle.numbers[INERTIA],
            0.0,
            0.0,
            0.0,
        )
        before[f"/bodyset/{body}"].inertia = after[f"/bodyset/{body}"].inertia
    for side in "LR":
        sphere = f"/contactgeometryset/{side}FootContact"
        assert after[sphere].location[0] == gait.model_cycle.numbers[AHEAD]
        before[sphere].location = after[sphere].location
    for coordinate in after.components(Coordinate):
        if coordinate.name in gait.start:
            mine = before[coordinate.path]
            mine.default_value, mine.default_speed_value = gait.start[coordinate.name]
    assert to_text(before) == to_text(after)


@pytest.mark.full
def test_the_files_tell_what_was_found_and_how(found):
    gait, folder, _ = found
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["numbers"] == gait.model_cycle.numbers and summary["settings"]["seed"] == 0
    assert summary["largest_multiplier"] == gait.model_cycle.cycle.largest
    heads, *rows = (folder / "cycles.csv").read_text().splitlines()
    assert (
        heads.split(",")[:3] == [INERTIA, AHEAD, "largest_multiplier"] and len(rows) == gait.cycles
    )


@pytest.mark.full
def test_another_walker_is_spared_unless_forced_and_the_same_seed_finds_the_same(found, tmp_path):
    gait, folder, _ = found
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(SettingError, match=r"seed \(0 before, 1 now\); .*--force"):
        find_gait(plan(dynamic_walker(), NEAR), folder, **FEW, seed=1)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    for name in ("best.osim", "cycles.csv", "summary.json"):
        (tmp_path / name).write_text("mine")
        with pytest.raises(
            SettingError, match=rf"{name}' was not written by such a search; .*--force"
        ):
            find_gait(plan(dynamic_walker(), NEAR), tmp_path, **FEW)
        assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
        (tmp_path / name).unlink()
    again = find_gait(plan(dynamic_walker(), NEAR), folder, **FEW, force=True, threads=1)
    assert again.model_cycle.cycle.state.tolist() == gait.model_cycle.cycle.state.tolist()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("said", "choice"),
    [
        ("seed must be a whole number from 0 to", {"seed": -1}),
        ("seed must be a whole number from 0 to", {"seed": 2**32 - 4}),
        ("'samples' must be a whole number of at least 1", {"samples": 0}),
        ("'budget' must be a whole number of at least 0", {"budget": -1}),
        ("'perturb' must be a positive number", {"perturb": float("nan")}),
        ("'stable' must be a positive number", {"stable": 0.0}),
        ("'digits' must be a whole number from 1 to 17", {"digits": 0}),
        ("'start_digits' must be a whole number from 1 to 17", {"start_digits": 18}),
    ],
)
def test_settings_are_checked_before_the_search(said, choice, tmp_path):
    with pytest.raises(SettingError, match=said):
        find_gait(plan(dynamic_walker(), NEAR), tmp_path / "new", **{**FEW, **choice})
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_searched_leaves_no_folder(tmp_path):
    model = dynamic_walker()
    model.add(
        PointConstraint(name="held", socket_body_1="/ground", socket_body_2="/bodyset/Pelvis")
    )
    with pytest.raises(
        UnsupportedError, match="constraints or prescribed coordinates: /constraintset/held"
    ):
        find_gait(plan(model, NEAR), tmp_path / "new", **FEW)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OsimliteError, match="this is a file, not a folder"):
        find_gait(plan(dynamic_walker(), NEAR), tmp_path / "file", **FEW)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.full
def test_more_of_them_walk_where_a_cycle_costs_less():
    """For sufficiently stable cycles, the fraction of walkers that keep walking decreases the cost."""
    search = CycleSearch(plan(dynamic_walker(), NEAR), stable=1.0, perturb=0.02)
    with Simulation(steady_walker(), "compiled") as simulation:
        cycle = find_cycle(StepMap(simulation.engine, simulation.initial_state({}, {})))
    known = search.find_cycle(
        search.compute_fractions({INERTIA: 0.0921, AHEAD: 0.0744}), cycle.state
    )
    assert known.cycle.state == pytest.approx(cycle.state, abs=1e-4)
    assert known.walking > 0.5 and known.cost == 1.0 - known.walking
    search.stable = 0.1
    strict = search.find_cycle(known.fractions, cycle.state)
    assert strict.cost == strict.cycle.largest and strict.walking == 0.0


def test_rounded_numbers_have_no_noise_in_the_last_bit():
    search = CycleSearch(plan(dynamic_walker(), NEAR | {INERTIA: (0.02, 1.0, "log")}))
    for inertia in (0.0894, 0.0673, 0.112, 0.33):
        numbers = search.get_numbers(
            search.round_fractions(search.compute_fractions({INERTIA: inertia, AHEAD: 0.0694}), 3)
        )
        assert numbers == {INERTIA: inertia, AHEAD: 0.0694}


def test_random_walkers_do_not_depend_on_the_numbers_that_are_searched():
    """Results are equal to the last bit, so that a search that starts from a walker found before finds it again."""
    ranges = {"slope": (2.0, 3.5), "foot_radius": (0.1, 0.2)} | {
        name: (-0.3, 0.3) for name in JOINTS
    }
    found = []
    for slope, radius in ((2.7, 0.1), (3.1, 0.17)):
        given = {"slope": slope, "foot_radius": radius}
        made = plan(
            lambda numbers, given=given: human_walker(**(given | numbers)), ranges, parameters=given
        )
        found.append(CycleSearch(made).find_candidates(choose(256, 512), 0))
    assert len(found[0]) > 3
    assert [each.miss for each in found[0]] == [each.miss for each in found[1]]
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one.state, other.state) and np.array_equal(
            one.fractions, other.fractions
        )


class Valley:
    """Search whose largest multiplier is a narrow, slanting valley of two variables that ends at (0.8, 0.8)."""

    stable = 0.5

    def __init__(self):
        self.asked = []

    def round_fractions(self, fractions, digits):
        return np.round(fractions, digits)

    def find_cycle(self, fractions, state):
        self.asked.append(fractions)
        along, across = fractions.sum() - 1.6, fractions[0] - fractions[1]
        largest = 0.2 + abs(along) + 300.0 * abs(across)
        if largest > 3.0:
            raise SimulationError("no cycle")
        cost = largest if largest >= self.stable else self.stable - 0.5 * (1.0 - abs(along))
        return ModelCycle(fractions, {}, SimpleNamespace(state=state), 0.0, cost)


def test_a_narrow_valley_is_followed_to_rounded_numbers():
    """The optimization follows the narrow valley without rounding, and rounds where it is wide enough."""
    valley = Valley()
    first = valley.find_cycle(np.array([0.3111, 0.3113]), np.zeros(2))
    improvement = StabilityOptimization(valley, first, 2)
    improvement.run(400, 0)
    assert improvement.best.cost < valley.stable
    assert (improvement.best.fractions == np.round(improvement.best.fractions, 2)).all()
    assert improvement.best.fractions == pytest.approx([0.8, 0.8], abs=0.05)
    assert len(valley.asked) <= 401 and len(improvement.cycles) < 400
    assert len({tuple(each) for each in valley.asked}) == len(valley.asked)


def test_a_search_that_gets_nowhere_keeps_the_first_cycle():
    valley = Valley()
    first = valley.find_cycle(np.array([0.3, 0.3]), np.zeros(2))
    improvement = StabilityOptimization(valley, first, 2)
    improvement.run(0, 0)
    assert improvement.best is first and not improvement.cycles


def test_a_search_needs_random_starts():
    with pytest.raises(SettingError, match="vary the initial values or speeds"):
        CycleSearch(plan(dynamic_walker(), {INERTIA: (0.05, 0.1)}))
    with pytest.raises(SettingError, match="'RHip_rz' has 3 grid points"):
        CycleSearch(plan(dynamic_walker(), {"RHip_rz": "0.05:0.1:3"}))


def test_walkers_that_only_fall_are_told_of(tmp_path):
    falling = {name: (-1.4, -1.3) for name in ("RKnee_rz", "LKnee_rz")}
    with pytest.raises(SimulationError, match="none of 64 random walkers made two steps"):
        find_gait(plan(dynamic_walker(), falling), tmp_path / "none", samples=64)
    assert not (tmp_path / "none").exists()


def test_the_command_writes_a_walker(tmp_path):
    words = [f"--vary={name}={low!r}:{high!r}" for name, (low, high) in NEAR.items()]
    options = [
        f"--samples={choose(64, 256)}",
        "--tries=3",
        "--enough=1",
        "--budget=0",
        "--start-digits=4",
        "-o",
        str(tmp_path),
    ]
    done = CliRunner().invoke(
        create_app(["find-gait"]), ["find-gait", "dynamic-walker", *words, *options]
    )
    assert "largest Floquet multiplier" in done.output and done.exit_code in (0, 1)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["settings"]["seed"] == 0 and {*summary["numbers"]} == {INERTIA, AHEAD}
    heads, *rows = (tmp_path / "cycles.csv").read_text().splitlines()
    assert heads.split(",")[:3] == [INERTIA, AHEAD, "largest_multiplier"] and rows
    largest = [float(row.split(",")[2]) for row in rows]
    assert summary["largest_multiplier"] == pytest.approx(min(largest), abs=0.05)
    start = summary["start"]
    numbers = np.array([number for each in start.values() for number in each.values()])
    assert (numbers == [float(f"{number:.4g}") for number in numbers]).all()
