"""``osimlite optimize``: search for the initial state, controls or parameters of an optimum."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli import _sweeping as sweeping
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import FactTable

if TYPE_CHECKING:
    from osimlite.studies.sweep.optimize import Optimum


@command_with(
    options.list_simulation_options(*sweeping.SWEEP_OPTIONS, integration=True),
    {
        "Search": (
            "method",
            "popsize",
            "sigma",
            "seed",
            "start",
            "maximize",
            "unbounded",
            "tolerance",
            "measure",
            "workers",
            "cluster",
        ),
        "Simulation": sweeping.SIMULATION_PARAMETERS,
    },
)
def optimize(
    source: options.Source,
    objective: Annotated[
        str,
        Option(
            metavar="NAME",
            help="Objective: distance, steps, progress, time_to_fall (maximized), largest_force, "
            "scuffs, energy, an expression such as 'max(pelvis_Y)', or module:function (minimized).",
            show_default=False,
        ),
    ],
    vary: sweeping.Vary = None,
    budget: Annotated[int, Option(metavar="N", help="Maximum number of runs.")] = 1000,
    method: Annotated[
        str,
        Option(
            help="cma, sobol-cma (few hundred runs), differential-evolution, nelder-mead or gradient (exact "
            "derivatives, for many variables)."
        ),
    ] = "cma",
    popsize: Annotated[
        int | None,
        Option(metavar="N", help="Number of runs per iteration.", show_default="by the method"),
    ] = None,
    sigma: Annotated[
        float,
        Option(help="Initial standard deviation, as a fraction of each range."),
    ] = 0.25,
    seed: Annotated[int, Option(help="Seed of the random numbers.")] = 0,
    start: Annotated[
        Path | None,
        Option(
            metavar="FOLDER",
            help="Start at the best result of another search.",
            show_default="the model",
        ),
    ] = None,
    maximize: Annotated[
        bool | None,
        Option(
            "--maximize/--minimize", help="Direction of the search.", show_default="see --objective"
        ),
    ] = None,
    unbounded: Annotated[
        bool,
        Option(
            "--unbounded",
            help="Let the search leave the ranges of --vary.",
        ),
    ] = False,
    tolerance: Annotated[
        float | None,
        Option(help="Tolerance of convergence.", show_default="by the method"),
    ] = None,
    measure: Annotated[
        list[str] | None,
        Option(
            "--measure",
            metavar="NAME",
            help="Write this measure into the history, too.",
            show_default=False,
        ),
    ] = None,
    to: options.To = 2.0,
    engine: options.Engine = None,
    stop_below: sweeping.Below = None,
    stop_above: sweeping.Above = None,
    planted: sweeping.Planted = False,
    foot: options.Foot = None,
    report_interval: sweeping.ReportInterval = None,
    parameter: options.Parameters = None,
    workers: sweeping.Workers = None,
    cluster: sweeping.Cluster = None,
    output: Annotated[
        Path,
        Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder of the results.",
        ),
    ] = Path("optimum"),
    resume: Annotated[
        bool, Option("--resume", help="Continue an interrupted or finished search.")
    ] = False,
    force: Annotated[
        bool, Option("--force", help="Replace the results of another search.")
    ] = False,
    controls: options.Controls = None,
    controller: options.Controller = None,
    par: options.Par = None,
    interpolation: sweeping.Interpolation = "linear",
    **option_values: Any,
) -> None:
    """Search for the initial state, controls or parameters that optimize an objective, and write the best model.

    Example: osimlite optimize walker.osim --objective distance --vary RHip_rz=0:60deg --vary
        Pelvis_tx/speed=0:2
    """
    from osimlite.base.files import make_folder_of
    from osimlite.cli._progress import progress_bar
    from osimlite.studies.sweep.optimize import Objective, read_best_values
    from osimlite.studies.sweep.optimize import optimize as search

    plan = sweeping.make_plan(
        source,
        vary,
        parameter,
        stop_below,
        stop_above,
        controls,
        measures=tuple(measure or ()),
        to=to,
        engine=engine,
        report_interval=report_interval,
        interpolation=interpolation,
        is_planted=planted,
        feet=tuple(foot) if foot else None,
        controller=options.read_feedback(controller, par),
        **option_values,
    )
    make_folder_of(output)
    with progress_bar("searching", budget) as progress:
        result = search(
            plan,
            Objective(objective, maximize),
            output,
            method=method,
            budget=budget,
            popsize=popsize,
            seed=seed,
            sigma=sigma,
            tolerance=tolerance,
            is_bounded=not unbounded,
            resume=resume,
            force=force,
            start=read_best_values(start) if start else None,
            workers=workers,
            cluster=cluster,
            progress=progress,
        )
    _describe_optimum(objective, result).show()


def _describe_optimum(objective: str, optimum: Optimum) -> FactTable:
    from osimlite.studies.sweep.optimize import BEST_FILE, HISTORY_FILE, PAR_FILE, SUMMARY_FILE

    facts = FactTable(f"{objective} {optimum.value:.6g}")
    for name, value in optimum.values.items():
        facts.add(name, f"{value:.6g}")
    facts.add("runs", f"{optimum.evaluations}, the best was number {optimum.evaluation}")
    facts.add("ended", optimum.ended)
    names = (
        BEST_FILE,
        HISTORY_FILE,
        SUMMARY_FILE,
        # Only searches for parameters of a controller write this file.
        *([PAR_FILE] if optimum.model.with_name(PAR_FILE).exists() else []),
    )
    facts.add_files(optimum.model.with_name(name) for name in names)
    return facts
