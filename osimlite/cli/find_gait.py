"""``osimlite find-gait``: search for parameters and an initial state of stable walking."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.cli import _options as options
from osimlite.cli import _sweeping as sweeping
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import FactTable

if TYPE_CHECKING:
    from osimlite.studies.gait.gaits import Gait


@command_with(options.list_simulation_options("skip_unsupported"))
def find_gait(
    source: options.Source,
    vary: sweeping.Vary = None,
    samples: Annotated[
        int, Option(min=1, metavar="N", help="Number of random walkers to try.")
    ] = 65536,
    tries: Annotated[
        int, Option(min=1, metavar="N", help="Number of best walkers to refine to gait cycles.")
    ] = 40,
    enough: Annotated[
        int,
        Option(
            min=1,
            metavar="N",
            help="Stop refining walkers when N gait cycles are found. The later optimization of the stability finds "
            "further cycles.",
        ),
    ] = 5,
    budget: Annotated[
        int,
        Option(min=0, metavar="N", help="Parameter sets to try when the stability is optimized."),
    ] = 300,
    stable: Annotated[
        float,
        Option(
            help="Optimize the stability until the largest Floquet multiplier is below this number. "
            "Then optimize the share of walkers that keep walking after a perturbation."
        ),
    ] = 0.6,
    perturb: Annotated[
        float,
        Option(
            metavar="PART",
            help="Largest relative change of the initial values and speeds of perturbed walkers: 0.1 is 10 %.",
        ),
    ] = 0.1,
    digits: Annotated[
        int, Option(min=1, max=17, metavar="N", help="Round the parameters to N digits.")
    ] = 3,
    start_digits: Annotated[
        int | None,
        Option(
            min=1,
            max=17,
            metavar="N",
            help="Round the initial state to N digits.",
            show_default="not rounded",
        ),
    ] = None,
    seed: Annotated[
        int, Option(help="Seed of the random numbers; equal seeds give equal searches.")
    ] = 0,
    foot: options.Foot = None,
    parameter: options.Parameters = None,
    output: Annotated[
        Path,
        Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder for best.osim, cycles.csv, summary.json.",
        ),
    ] = Path("found"),
    force: Annotated[
        bool, Option("--force", help="Replace the results of another search.")
    ] = False,
    *,
    skip_unsupported: bool,
) -> None:
    """Search for parameters and an initial state with which a walker never stops, and write the model.

    Give the ranges of the parameters, and of the coordinates and speeds of a random initial state.
    The walker is put on the ground with one foot at rest. Random walkers whose second step is most
    similar to their first are refined to gait cycles. The best cycle is optimized until its largest
    Floquet multiplier is small, and then until most of 60 walkers that start near it make 20 steps.

    Example: osimlite find-gait walker.osim --vary '/bodyset/*Shank/inertia/2=0.02:1:log' --vary
    RHip_rz=-30deg:60deg --vary LHip_rz=-30deg:60deg --vary RHip_rz/speed=-4:4 --vary
    LHip_rz/speed=-4:4
    """
    from osimlite.cli._progress import progress_bars
    from osimlite.studies.gait.gaits import find_gait as search

    plan = sweeping.make_plan(
        source, vary, parameter, None, None, skip_unsupported=skip_unsupported
    )
    with progress_bars() as stage:
        gait = search(
            plan,
            output,
            feet=foot,
            samples=samples,
            tries=tries,
            enough=enough,
            budget=budget,
            stable=stable,
            perturb=perturb,
            digits=digits,
            start_digits=start_digits,
            seed=seed,
            force=force,
            stage=stage,
        )
    _describe_result(gait).show()
    # Scripts test the exit code: 0 means a stable walk to the end without scuffs.
    if not (gait.walk.walks and not gait.walk.scuffs and gait.model_cycle.cycle.largest < 1.0):
        raise SystemExit(1)


def _describe_result(gait: Gait) -> FactTable:
    from osimlite.base.text import format_count
    from osimlite.studies.gait.cycle_search import BASIN_STARTS, BASIN_STEPS

    cycle, walk = gait.model_cycle.cycle, gait.walk
    stable = "stable" if cycle.largest < 1.0 else "not stable"
    facts = FactTable(f"{stable}: largest Floquet multiplier {cycle.largest:.4g}")
    for name, number in gait.model_cycle.numbers.items():
        facts.add(name, f"{number:.6g}")
    facts.add("step length", f"{cycle.length:.6g} m")
    facts.add("period", f"{cycle.period:.6g} s")
    end = "still walking" if walk.walks else f"{walk.ending} {walk.fell_on}".strip()
    counts = f"{format_count(len(walk.steps), 'step')}, {format_count(len(walk.scuffs), 'scuff')}"
    facts.add("walk", f"{counts}; {end} after {walk.end:.4g} s")
    facts.add(
        "perturbed",
        f"{round(BASIN_STARTS * gait.model_cycle.walking)} of {BASIN_STARTS} initial states near the cycle "
        f"lead to {BASIN_STEPS} steps",
    )
    facts.add(
        "search",
        f"{format_count(gait.candidates, 'random walker')} made two steps; {format_count(gait.cycles, 'cycle')} found, "
        "including those of the stability optimization",
    )
    facts.add_files(gait.files)
    return facts
