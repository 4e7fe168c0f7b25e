"""``osimlite optimize``: the start, or the numbers, that serve a model best."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli import _sweeping as sweeping
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import Facts

if TYPE_CHECKING:
    from osimlite.studies.sweep.optimize import Optimum


@command_with(options.simulating(*sweeping.PASSED))
def optimize(
    source: options.Source,
    objective: Annotated[
        str,
        Option(
            metavar="NAME",
            help="What is wanted: distance, steps, progress, time_to_fall (the more, the better), largest_force, "
            "scuffs, energy, an expression such as 'max(pelvis_Y)', or module:function (the less, the better).",
            show_default=False,
        ),
    ],
    vary: sweeping.Vary = None,
    budget: Annotated[int, Option(metavar="N", help="How many runs are allowed.")] = 1000,
    method: Annotated[
        str,
        Option(
            help="cma, sobol-cma (for a few hundred runs), differential-evolution, nelder-mead or gradient (exact "
            "derivatives of the motion: for many variables, and smooth objectives)."
        ),
    ] = "cma",
    popsize: Annotated[
        int | None,
        Option(
            metavar="N", help="Runs between two decisions.", show_default="what suits the method"
        ),
    ] = None,
    sigma: Annotated[
        float,
        Option(
            help="How far from where it begins the method looks at first, as a fraction of the ranges."
        ),
    ] = 0.25,
    seed: Annotated[int, Option(help="The same seed, the same search.")] = 0,
    start: Annotated[
        Path | None,
        Option(
            metavar="FOLDER",
            help="Begin at what another search found, of variables that have the same names.",
            show_default="where the model is",
        ),
    ] = None,
    maximize: Annotated[
        bool | None,
        Option("--maximize/--minimize", help="What is better.", show_default="see --objective"),
    ] = None,
    unbounded: Annotated[
        bool, Option("--unbounded", help="The ranges say where to begin, and may be left.")
    ] = False,
    tolerance: Annotated[
        float | None,
        Option(help="At which the search has converged.", show_default="that of the method"),
    ] = None,
    measure: Annotated[
        list[str] | None,
        Option(
            "--measure",
            metavar="NAME",
            help="What else to keep in the history.",
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
            help="For history.parquet, best.osim, summary.json (and best.par).",
        ),
    ] = Path("optimum"),
    resume: Annotated[
        bool, Option("--resume", help="Go on with an interrupted or finished search.")
    ] = False,
    force: Annotated[bool, Option("--force", help="Replace what another search found.")] = False,
    controls: options.Controls = None,
    controller: options.Controller = None,
    par: options.Par = None,
    interpolation: sweeping.Interpolation = "linear",
    **chosen: Any,
) -> None:
    """Look for the start, the controls or other numbers with which a model does best; writes it with them.

    Of muscles: osimlite optimize jumper --objective 'max(center_of_mass_Y)' --maximize
    --vary '{*}_?/control@0:0.3:4=0:1'

    Of reflexes: osimlite optimize arm.osim --objective 'elbow/value' --maximize --controller
    hold.yaml

    Example: osimlite optimize walker.osim --objective distance --vary RHip_rz=0:60deg --vary
        Pelvis_tx/speed=0:2
    """
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
        controller=options.feedback(controller, par),
        **chosen,
    )
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
    _told(objective, result).show()


def _told(objective: str, found: Optimum) -> Facts:
    from osimlite.studies.sweep.optimize import BEST, HISTORY, PAR, SUMMARY

    facts = Facts(f"{objective} {found.value:.6g}")
    for name, value in found.values.items():
        facts.add(name, f"{value:.6g}")
    facts.add("runs", f"{found.evaluations}, the best was number {found.evaluation}")
    facts.add("ended", found.ended)
    names = BEST, HISTORY, SUMMARY, *([PAR] if found.model.with_name(PAR).exists() else [])
    facts.add("files", ", ".join(str(found.model.with_name(name)) for name in names))
    return facts
