"""``osimlite sweep``: simulate a model with many initial states or parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli import _sweeping as sweeping
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import FactTable, complain, say

if TYPE_CHECKING:
    from osimlite.studies.sweep.plan import Plan
    from osimlite.studies.sweep.run import Outcome


@command_with(
    options.list_simulation_options(*sweeping.SWEEP_OPTIONS, integration=True),
    {"Simulation": sweeping.SIMULATION_PARAMETERS},
)
def sweep(
    source: options.Source,
    vary: sweeping.Vary = None,
    samples: Annotated[
        int | None,
        Option(
            "--samples",
            metavar="N",
            help="Number of runs; leave it out for a grid.",
            show_default=False,
        ),
    ] = None,
    sampler: Annotated[
        str | None,
        Option(
            help="'grid', 'random', 'sobol' or 'lhs'.",
            show_default="grid if every range has a COUNT, else sobol",
        ),
    ] = None,
    seed: Annotated[int, Option(help="Seed of the samples; equal seeds give equal samples.")] = 0,
    measure: Annotated[
        list[str] | None,
        Option(
            "--measure",
            metavar="NAME",
            help="Quantity to write for each run: distance, energy, largest_force, steps, scuffs, progress, time_to_fall, "
            "COORDINATE/value, COORDINATE/speed, an expression such as 'max(pelvis_Y)', or module:function.",
            show_default="distance and largest_force",
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
            "-o", "--output", metavar="FILE", help="Parquet file to write, one row for each run."
        ),
    ] = Path("results.parquet"),
    resume: Annotated[bool, Option("--resume", help="Continue an interrupted sweep.")] = False,
    plot: Annotated[
        bool,
        Option(
            "--plot",
            help="Draw each measure over the varied quantities as PNG, beside the results.",
        ),
    ] = False,
    force: Annotated[bool, Option("--force", help="Replace results of other settings.")] = False,
    controls: options.Controls = None,
    controller: options.Controller = None,
    par: options.Par = None,
    interpolation: sweeping.Interpolation = "linear",
    **option_values: Any,
) -> None:
    """Simulate a model with many initial states or parameters; writes a table with one row for each run.

    Results of an interrupted sweep are saved beside the file, and --resume continues it.

    Example: osimlite sweep walker.osim --vary RHip_rz=20deg:40deg --vary Pelvis_tx/speed=0:1
        --samples 1000
    """
    from osimlite.base.files import make_folder_of
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import describe_pictures, require_plots
    from osimlite.studies.sweep.run import sweep as run
    from osimlite.studies.sweep.sampling import choose_samples as choose

    require_plots(plot=plot)
    plan = sweeping.make_plan(
        source,
        vary,
        parameter,
        stop_below,
        stop_above,
        controls,
        measures=tuple(measure) if measure else None,
        to=to,
        engine=engine,
        report_interval=report_interval,
        interpolation=interpolation,
        is_planted=planted,
        feet=tuple(foot) if foot else None,
        controller=options.read_feedback(controller, par),
        **option_values,
    )
    # Samples are drawn before the runs, so that a resumed sweep has the same.
    points = choose(plan.variables, sampler, samples, seed)
    make_folder_of(output)
    with progress_bar("sweeping", points.count) as progress:
        outcome = run(
            plan,
            points,
            output,
            resume=resume,
            force=force,
            workers=workers,
            cluster=cluster,
            progress=progress,
        )
    _describe_sweep(plan, outcome).show()
    if plot:
        from osimlite.studies.sweep.measures import get_measure_name
        from osimlite.view.sweep_plots import plot_runs

        names = [get_measure_name(spec) for spec in plan.measures]
        variables = [variable.name for variable in plan.variables]
        with progress_bar("drawing", None):
            paths = plot_runs(
                outcome.to_arrow().to_pydict(),
                variables,
                names,
                output.parent,
                output.stem,
                {variable.name: variable.unit for variable in plan.variables},
            )
        say(describe_pictures(paths))
    # Some failures are expected in a sweep; if all runs fail, the setting is wrong.
    if outcome.status["failed"] == outcome.count:
        complain("every run failed")
        raise SystemExit(1)


def _describe_sweep(plan: Plan, outcome: Outcome) -> FactTable:
    from osimlite.base.text import format_count
    from osimlite.studies.sweep.measures import get_measure_name
    from osimlite.studies.sweep.results import compute_ranges

    facts = FactTable(format_count(outcome.count, "run"))
    new_count = sum(outcome.status.values())
    if outcome.before:
        facts.add("done before", str(outcome.before))
    if new_count:
        facts.add(
            "time taken",
            f"{outcome.seconds:.3g} s, {new_count / outcome.seconds:.4g} runs per second",
        )
        facts.add(
            "ended",
            ", ".join(f"{count} {status}" for status, count in outcome.status.most_common()),
        )
    # The usual reasons; the table has a column with all of them.
    reasons = outcome.reasons.most_common(3)
    for reason, count in reasons:
        facts.add("failed", f"{format_count(count, 'run')}: {reason}")
    if other_count := outcome.status["failed"] - sum(count for _, count in reasons):
        facts.add(
            "failed",
            f"{format_count(other_count, 'run')} for other reasons; the column 'reason' has them all",
        )
    for name, result in compute_ranges(
        outcome.path, [get_measure_name(spec) for spec in plan.measures]
    ).items():
        facts.add(
            name,
            f"{result.least:.6g} (run {result.run_of_least}) to {result.most:.6g} (run {result.run_of_most}), "
            f"mean {result.mean:.6g}",
        )
    facts.add("file", str(outcome.path))
    return facts
