"""``osimlite gait``: how a walker walks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from osimlite.cli import _options as options

if TYPE_CHECKING:
    from osimlite.gait.basin import Basin
    from osimlite.gait.cycle import Cycle
    from osimlite.gait.stepmap import StepMap
    from osimlite.gait.steps import Walk


def gait(
    source: options.Source,
    start: options.Start = None,
    start_speed: options.StartSpeed = None,
    foot: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CONTACT",
            help="Contact of a foot, with + between several of one foot; once for each foot.",
            show_default="the ends of the legs",
        ),
    ] = None,
    to: Annotated[float, typer.Option("--to", metavar="SECONDS", help="How long to walk at most.")] = 60.0,
    settle: Annotated[int, typer.Option(min=0, metavar="N", help="Steps to make before the cycle is looked for.")] = 0,
    accuracy: Annotated[float, typer.Option(help="Of the integrator in the step map.")] = 1e-10,
    perturb: Annotated[
        list[float] | None,
        typer.Option(metavar="PART", help="Start at random so near the start: 0.05 is 5 %.", show_default=False),
    ] = None,
    starts: Annotated[int, typer.Option(min=1, metavar="N", help="How many such starts.")] = 60,
    seed: Annotated[int, typer.Option(help="The same seed, the same such starts.")] = 0,
    steps: Annotated[int, typer.Option(min=1, metavar="N", help="Steps after which a walker counts as walking.")] = 20,
    basin: Annotated[
        bool, typer.Option("--basin", help="Look from where on a grid around the cycle it walks.")
    ] = False,
    basin_x: Annotated[
        str, typer.Option(metavar="NAME", help="What the columns change: COORDINATE or COORDINATE/speed.")
    ] = "",
    basin_y: Annotated[str, typer.Option(metavar="NAME", help="What the rows change.")] = "",
    reach: Annotated[float, typer.Option(help="How far from the cycle, rad, m or per second.")] = 0.5,
    grid: Annotated[int, typer.Option(min=2, metavar="N", help="Rows and columns.")] = 21,
    pictures: Annotated[bool, typer.Option(help="Draw the basin.")] = True,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FOLDER", help="For gait.json, basin.csv, basin.png.", show_default=False
        ),
    ] = None,
) -> None:
    """Count the steps of a walker, find the cycle that it walks in, and say whether that is stable.

    The walk begins at the model's default values and speeds. A step is the other foot touching down at least 5 cm
    ahead along the slope after at least 0.05 s in the air; any other touch-down is a scuff; anything but a foot on the
    ground ends the walk.

    Example: osimlite gait steady-walker --perturb 0.05 --basin -o gait
    """
    from rich.console import Console

    from osimlite._require import require
    from osimlite.cli._progress import progress_bar
    from osimlite.document.reader import read
    from osimlite.errors import OsimliteError
    from osimlite.gait.basin import find_basin, perturbed, walks_from
    from osimlite.gait.cycle import find_cycle
    from osimlite.gait.footing import find_footing
    from osimlite.gait.stepmap import StepMap
    from osimlite.gait.steps import walk_many
    from osimlite.models.source import make_model
    from osimlite.simulation.run import Simulation

    if basin and pictures and output:
        require("matplotlib", extra="plot", purpose="a picture of a basin")
    console = Console()
    model = read(source) if Path(source).suffix.lower() == ".osim" else make_model(source)
    with Simulation(model, "compiled") as simulation:
        engine: Any = simulation.engine
        state = simulation.initial_state(
            options.quantities(start, simulation.mechanism, "--set"),
            options.quantities(start_speed, simulation.mechanism, "--set-speed"),
        )
        footing = find_footing(engine, foot)
        (walk,) = walk_many(engine, [state], to, footing=footing, accuracy=1e-6)
        step_map, cycle, why = None, None, ""
        try:
            step_map = StepMap(engine, state, footing=footing, accuracy=accuracy)
            cycle = find_cycle(step_map, settle=settle)
        except OsimliteError as error:
            why = error.message
        nearby: list[tuple[float, int]] = []
        found = None
        if step_map is not None and cycle is not None:
            for part in perturb or []:
                with progress_bar(f"starting within {part:.0%}", starts) as progress:
                    states = perturbed(step_map, state, part, starts, seed)
                    walks = walks_from(step_map, cycle, states, steps, progress=progress)
                nearby.append((part, sum(len(each.steps) >= steps for each in walks)))
            if basin:
                with progress_bar("basin", grid * grid) as progress:
                    found = find_basin(
                        step_map, cycle, basin_x, basin_y, reach=reach, grid=grid, wanted=steps, progress=progress
                    )
        files = _write(output, engine, walk, cycle, nearby, starts, found, pictures) if output else []
        console.print(_table(engine, walk, step_map, cycle, why, nearby, starts, steps, found, files))


def _table(
    engine: Any,
    walk: Walk,
    step_map: StepMap | None,
    cycle: Cycle | None,
    why: str,
    nearby: list[tuple[float, int]],
    starts: int,
    steps: int,
    found: Basin | None,
    files: list[Path],
) -> Any:
    from rich.table import Table

    table = Table(title=engine.mechanism.name, title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    end = f"fell on {walk.fell_on} after {walk.end:.4g} s" if walk.fell_on else f"{walk.ending} after {walk.end:.4g} s"
    table.add_row("walk", f"{len(walk.steps)} steps, {len(walk.scuffs)} scuffs, {walk.distance:.4g} m; {end}")
    if step_map is None or cycle is None:
        table.add_row("cycle", why)
        return table
    table.add_row("step length", f"{cycle.length:.6g} m")
    table.add_row("period", f"{cycle.period:.6g} s" + (" (mean of the two steps)" if cycle.per_stride else ""))
    table.add_row("speed", f"{cycle.speed:.6g} m/s")
    if cycle.scuffs:
        table.add_row("scuffs", f"{cycle.scuffs} in each {'stride' if cycle.per_stride else 'step'}")
    stable = "stable" if cycle.largest < 1.0 else "not stable"
    table.add_row("stability", f"{stable}: largest multiplier {cycle.largest:.4g}")
    sizes = ", ".join(f"{size:.3g}" for size in abs(cycle.multipliers[:6]))
    table.add_row("multipliers", f"{sizes} ...; {cycle.neutral} neutral directions left out")
    table.add_row("fixed point", f"to {cycle.residual:.2g} after {cycle.iterations} steps of Newton")
    for part, count in nearby:
        table.add_row(f"within {part:.0%}", f"{count} of {starts} starts make {steps} steps")
    if found is not None:
        table.add_row("basin", f"{found.part:.0%} of {found.steps.size} starts make {found.wanted} steps")
    if files:
        table.add_row("files", ", ".join(str(path) for path in files))
    return table


def _write(
    folder: Path,
    engine: Any,
    walk: Walk,
    cycle: Cycle | None,
    nearby: list[tuple[float, int]],
    starts: int,
    found: Basin | None,
    pictures: bool,
) -> list[Path]:
    import json

    from osimlite.files import make_folder, write_atomically

    make_folder(folder)
    facts: dict[str, Any] = {
        "model": engine.mechanism.name,
        "walk": {
            "steps": [{"time_s": s.time, "foot": s.foot, "length_m": s.length, "air_s": s.air} for s in walk.steps],
            "scuffs": [{"time_s": s.time, "foot": s.foot, "length_m": s.length, "air_s": s.air} for s in walk.scuffs],
            "end_s": walk.end,
            "ending": walk.ending,
            "fell_on": walk.fell_on,
        },
    }
    if cycle is not None:
        names = [engine.mechanism.coordinate_names[place] for place in engine.order]
        n = len(names)
        facts["cycle"] = {
            "values": dict(zip(names, cycle.state[:n].tolist(), strict=True)),
            "speeds": dict(zip(names, cycle.state[n:].tolist(), strict=True)),
            "step_length_m": cycle.length,
            "period_s": cycle.period,
            "speed_m_per_s": cycle.speed,
            "multipliers": [[value.real, value.imag] for value in cycle.multipliers.tolist()],
            "neutral_directions": cycle.neutral,
            "residual": cycle.residual,
            "scuffs": cycle.scuffs,
            "per_stride": cycle.per_stride,
        }
        facts["random_starts"] = [{"part": part, "walk": count, "of": starts} for part, count in nearby]
    written = [folder / "gait.json"]
    write_atomically(written[0], (json.dumps(facts, indent=1) + "\n").encode())
    if found is not None:
        rows = [f"{found.x.label},{found.y.label},steps"]
        for y, line in zip(found.y.values.tolist(), found.steps.tolist(), strict=True):
            rows += [f"{x!r},{y!r},{count}" for x, count in zip(found.x.values.tolist(), line, strict=True)]
        written.append(folder / "basin.csv")
        write_atomically(written[-1], ("\n".join(rows) + "\n").encode())
        if pictures:
            from osimlite.view.basin import draw_basin

            written.append(draw_basin(found, folder / "basin.png", title=engine.mechanism.name))
    return written
