"""``osimlite gait``: step count, gait cycle and stability of a walker."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.base.records import dataclass, field
from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import FactTable
from osimlite.cli._progress import progress_bar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from osimlite.simulation.batches import BatchEngine
    from osimlite.studies.gait.basin import Basin
    from osimlite.studies.gait.cycle import Cycle
    from osimlite.studies.gait.stepmap import StepMap
    from osimlite.studies.gait.steps import GaitStep, Scuff, WalkerSteps


WALK_ACCURACY = 1e-6
"""Accuracy of the integrator in the walk from the initial state; the step map has its own option."""


@command_with(options.list_simulation_options("skip_unsupported"))
def gait(
    source: options.Source,
    start: options.Start = None,
    start_speed: options.StartSpeed = None,
    foot: options.Foot = None,
    to: Annotated[
        float, Option("--to", metavar="SECONDS", help="Maximum duration of the walk.")
    ] = 60.0,
    settle: Annotated[
        int,
        Option(
            min=0, metavar="N", help="Number of steps to walk before the search for the gait cycle."
        ),
    ] = 0,
    accuracy: Annotated[
        float, Option(help="Integrator accuracy in the computation of the gait cycle.")
    ] = 1e-10,
    perturb: Annotated[
        list[float] | None,
        Option(
            metavar="PART",
            help="Change the initial state at random by at most this share: 0.05 is 5 %.",
            show_default=False,
        ),
    ] = None,
    starts: Annotated[
        int, Option(min=1, metavar="N", help="Number of random initial states.")
    ] = 60,
    seed: Annotated[int, Option(help="Seed of the random initial states.")] = 0,
    steps: Annotated[
        int,
        Option(
            min=1,
            metavar="N",
            help="With --perturb or --basin: the model counts as walking if it makes this number of steps.",
        ),
    ] = 20,
    basin: Annotated[
        bool,
        Option(
            "--basin",
            help="Test from which initial states, on a grid around the cycle, the model walks.",
        ),
    ] = False,
    basin_x: Annotated[
        str, Option(metavar="NAME", help="Variable of the columns: COORDINATE or COORDINATE/speed.")
    ] = "",
    basin_y: Annotated[str, Option(metavar="NAME", help="Variable of the rows.")] = "",
    reach: Annotated[
        float, Option(help="Half the width of the grid around the cycle (rad, m, rad/s or m/s).")
    ] = 0.5,
    grid: Annotated[
        int, Option(min=2, metavar="N", help="Number of rows and of columns of the grid.")
    ] = 21,
    pictures: Annotated[
        bool, Option(help="Draw the basin (the initial states from which the model walks) as PNG.")
    ] = True,
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder for gait.json, basin.csv, basin.png.",
            show_default=False,
        ),
    ] = None,
    parameter: options.Parameters = None,
    *,
    skip_unsupported: bool,
) -> None:
    """Count the steps of a walker, compute its gait cycle, and report whether the cycle is stable.

    The walk begins at the model's default values and speeds, or at those of --set and --set-speed.
    A step is a touch-down of the other foot, at least 5 cm ahead along the slope and after at least
    0.05 s in the air. Any other touch-down is a scuff. The walk ends when any part other than a foot
    touches the ground.

    Exits with 1 if no gait cycle is found.

    Example: osimlite gait steady-walker --perturb 0.05 --basin -o gait
    """
    from osimlite.base.files import prepare_folder
    from osimlite.base.require import require
    from osimlite.simulation.run import Simulation
    from osimlite.studies.gait.basin import (
        find_basin,
        find_basin_offsets,
        sample_perturbed_starts,
        simulate_walks,
    )
    from osimlite.studies.gait.stepmap import refuse_constraints

    # A missing package is reported before the walk, which may take minutes.
    if basin and pictures and output:
        require("matplotlib", extra="plot", purpose="a picture of a basin")
    # The numbers are checked before the simulation, and names of variables after the model is read.
    _check_numbers(to, accuracy, reach, perturb or (), seed)
    model, folder = options.read_source(source, parameter)
    with ExitStack() as stack:
        output_folder = None if output is None else stack.enter_context(prepare_folder(output))
        simulation = stack.enter_context(
            Simulation(model, "compiled", skip_unsupported=skip_unsupported, folder=folder)
        )
        refuse_constraints(simulation.mechanism)
        state = simulation.initial_state(
            options.parse_quantities(start, simulation.mechanism, "--set"),
            options.parse_quantities(start_speed, simulation.mechanism, "--set-speed"),
        )
        # Batches are methods of the compiled engine only, which the type of `engine` does not say.
        engine: Any = simulation.engine
        # Check the names of the variables before the walk, not after it.
        find_basin_offsets(engine, basin_x, basin_y)
        result, step_map = simulate_walk(engine, state, foot, to, settle, accuracy)
        # Forces that were left out change the gait, so the report names them.
        result.skipped = simulation.forces.skipped
        cycle = result.cycle
        if step_map is not None and cycle is not None:
            for size in perturb or ():
                with progress_bar(f"starting within {size:.0%}", starts) as progress:
                    states = sample_perturbed_starts(step_map, state, size, starts, seed)
                    walks = simulate_walks(step_map, cycle, states, steps, progress=progress)
                result.nearby.append(
                    Nearby(size, sum(len(walk.steps) >= steps for walk in walks), starts, steps)
                )
            if basin:
                with progress_bar("basin", grid * grid) as progress:
                    result.basin = find_basin(
                        step_map,
                        cycle,
                        basin_x,
                        basin_y,
                        reach=reach,
                        grid=grid,
                        target_steps=steps,
                        progress=progress,
                    )
        files = _write(output_folder, result, pictures) if output_folder else []
    _describe_cycle(result, files).show()
    # Scripts test the exit code for a cycle.
    if cycle is None:
        raise SystemExit(1)


def _check_numbers(
    to: float, accuracy: float, reach: float, perturb: Sequence[float], seed: int
) -> None:
    """Check numeric options before the walk, which takes a while.

    Raises:
        SettingError: a number is not positive and finite, or the seed is negative.
    """
    from math import inf

    from osimlite.errors import SettingError

    numbers = [
        ("--to", to),
        ("--accuracy", accuracy),
        ("--reach", reach),
        *(("--perturb", size) for size in perturb),
    ]
    for option, number in numbers:
        # `not 0 < number < inf` also refuses NaN.
        if not 0.0 < number < inf:
            raise SettingError(f"{option} must be a positive number, not {number:g}")
    if seed < 0:
        raise SettingError(f"the seed must be a whole number of at least 0, not {seed}")


@dataclass
class Nearby:
    """Result of random starts near an initial state.

    Attributes:
        part: largest relative change of the initial state.
        walked: number of starts that make `steps` steps.
        starts: number of starts.
        steps: steps that count as walking.
    """

    part: float
    walked: int
    starts: int
    steps: int


@dataclass
class GaitReport:
    """Results of ``osimlite gait`` for one walker.

    Attributes:
        model: name of the model.
        coordinates: names in the order of the state.
        walk: walk from the initial state.
        cycle: gait cycle near the walk; None without one.
        why_not: why no cycle was found; empty otherwise.
        nearby: results of random starts, one for each ``--perturb``.
        basin: result of ``--basin``.
        skipped: forces that the simulation leaves out.
    """

    model: str
    coordinates: list[str]
    walk: WalkerSteps
    cycle: Cycle | None = None
    why_not: str = ""
    nearby: list[Nearby] = field(default_factory=list)
    basin: Basin | None = None
    skipped: Sequence[str] = ()


def simulate_walk(
    engine: BatchEngine,
    state: Sequence[float],
    feet: Sequence[str] | None,
    to: float,
    settle: int,
    accuracy: float,
) -> tuple[GaitReport, StepMap | None]:
    """Simulate the walk from an initial state, and search for a gait cycle near it.

    Args:
        engine: engine of the model.
        state: coordinates and speeds at the start.
        feet: contact forces of the feet; the ends of the legs by default.
        to: maximum duration, s.
        settle: number of steps before the search for the cycle.
        accuracy: accuracy of the integrator in the step map.

    Returns:
        The report, and the step map with the cycle as its fixed point; None if it cannot be built.
    """
    from osimlite.errors import OsimliteError
    from osimlite.studies.gait.cycle import find_cycle
    from osimlite.studies.gait.foot_contacts import find_footing
    from osimlite.studies.gait.stepmap import StepMap
    from osimlite.studies.gait.steps import walk_many

    footing = find_footing(engine, feet)
    (walk,) = walk_many(engine, [state], to, footing=footing, accuracy=WALK_ACCURACY)
    names = [engine.mechanism.coordinate_names[index] for index in engine.order]
    result = GaitReport(engine.mechanism.name, names, walk)
    step_map = None
    try:
        step_map = StepMap(engine, state, footing=footing, accuracy=accuracy)
        result.cycle = find_cycle(step_map, warm_up_steps=settle)
    # A walker that falls has no cycle: that is a result, not an error.
    except OsimliteError as error:
        result.why_not = error.message
    return result, step_map


def _describe_cycle(result: GaitReport, files: Sequence[Path]) -> FactTable:
    from osimlite.base.text import format_count
    from osimlite.simulation.elements import summarize_skipped

    walk, cycle = result.walk, result.cycle
    facts = FactTable(result.model)
    # The ending without a fall is "walking".
    end = (
        f"fell on {walk.fell_on} after {walk.end:.4g} s"
        if walk.fell_on
        else f"still walking after {walk.end:.4g} s"
        if walk.ending == "walking"
        else f"{walk.ending} after {walk.end:.4g} s"
    )
    facts.add(
        "walk",
        f"{format_count(len(walk.steps), 'step')}, {format_count(len(walk.scuffs), 'scuff')}, {walk.distance:.4g} m; {end}",
    )
    if cycle is None:
        facts.add("cycle", result.why_not)
    else:
        facts.add("step length", f"{cycle.length:.6g} m")
        facts.add(
            "period",
            f"{cycle.period:.6g} s" + (" (mean of the two steps)" if cycle.per_stride else ""),
        )
        facts.add("speed", f"{cycle.speed:.6g} m/s")
        if cycle.scuffs:
            facts.add(
                "scuffs", f"{cycle.scuffs} in each {'stride' if cycle.per_stride else 'step'}"
            )
        stable = "stable" if cycle.largest < 1.0 else "not stable"
        facts.add("stability", f"{stable}: largest Floquet multiplier {cycle.largest:.4g}")
        # Large eigenvalues decide about stability; of high-dimensional models only the first six
        # are shown.
        sizes = ", ".join(f"{size:.3g}" for size in abs(cycle.multipliers[:6]))
        facts.add(
            "multipliers",
            f"{sizes} ...; {format_count(cycle.neutral, 'multiplier')} of neutral directions not shown",
        )
        facts.add(
            "fixed point",
            f"residual {cycle.residual:.2g} after {format_count(cycle.iterations, 'Newton step')}",
        )
    for neighbourhood in result.nearby:
        facts.add(
            f"within {neighbourhood.part:.0%}",
            f"{neighbourhood.walked} of {neighbourhood.starts} initial states near the cycle lead to "
            f"{format_count(neighbourhood.steps, 'step')}",
        )
    if result.basin is not None:
        basin = result.basin
        facts.add(
            "basin",
            f"{basin.part:.0%} of {format_count(basin.steps.size, 'initial state')} lead to "
            f"{format_count(basin.target_steps, 'step')}",
        )
    for skipped in summarize_skipped(result.skipped):
        facts.add("left out", skipped)
    if files:
        facts.add_files(files)
    return facts


def _write(folder: Path, result: GaitReport, pictures: bool) -> list[Path]:
    import json

    from osimlite.base.files import write_atomically

    paths = [folder / "gait.json"]
    write_atomically(paths[0], (json.dumps(_make_json(result), indent=1) + "\n").encode())
    basin = result.basin
    for name in ("basin.csv", "basin.png"):
        # Files of an earlier run would be mistaken for results of this one.
        (folder / name).unlink(missing_ok=True)
    if basin is not None:
        rows = [f"{basin.x.label},{basin.y.label},steps"]
        # `tolist` gives Python's floats, whose repr has the digits that read back equal.
        for y, line in zip(basin.y.values.tolist(), basin.steps.tolist(), strict=True):
            rows += [
                f"{x!r},{y!r},{count}"
                for x, count in zip(basin.x.values.tolist(), line, strict=True)
            ]
        paths.append(folder / "basin.csv")
        write_atomically(paths[-1], ("\n".join(rows) + "\n").encode())
        if pictures:
            from osimlite.studies.gait.basin_plot import draw_basin

            paths.append(draw_basin(basin, folder / "basin.png", title=result.model))
    return paths


def _make_json(result: GaitReport) -> dict[str, Any]:
    """Return the content of gait.json."""

    def list_touches(events: Sequence[GaitStep | Scuff]) -> list[dict[str, Any]]:
        return [
            {"time_s": event.time, "foot": event.foot, "length_m": event.length, "air_s": event.air}
            for event in events
        ]

    walk, cycle, names = result.walk, result.cycle, result.coordinates
    facts: dict[str, Any] = {
        "model": result.model,
        "walk": {
            "steps": list_touches(walk.steps),
            "scuffs": list_touches(walk.scuffs),
            "end_s": walk.end,
            "ending": walk.ending,
            "fell_on": walk.fell_on,
        },
    }
    if cycle is None:
        facts |= {"cycle": None, "why_no_cycle": result.why_not}
    else:
        count = len(names)
        facts["cycle"] = {
            "values": dict(zip(names, cycle.state[:count].tolist(), strict=True)),
            "speeds": dict(zip(names, cycle.state[count:].tolist(), strict=True)),
            "step_length_m": cycle.length,
            "period_s": cycle.period,
            "speed_m_per_s": cycle.speed,
            # JSON has no complex numbers.
            "multipliers": [[value.real, value.imag] for value in cycle.multipliers.tolist()],
            "neutral_directions": cycle.neutral,
            "residual": cycle.residual,
            "scuffs": cycle.scuffs,
            "per_stride": cycle.per_stride,
        }
        facts["random_starts"] = [
            {"part": event.part, "walk": event.walked, "of": event.starts, "steps": event.steps}
            for event in result.nearby
        ]
    return facts
