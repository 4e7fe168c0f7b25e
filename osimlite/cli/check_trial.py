"""``osimlite check-trial``: compare a finished trial with published limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, command

if TYPE_CHECKING:
    from osimlite.tools.trials.check import TrialReport


@command
def check_trial(
    paths: Annotated[
        list[str],
        Argument(
            metavar="PATH",
            help="Folders with setups and their results, or setups of ScaleTool, InverseKinematicsTool, "
            "InverseDynamicsTool, RRATool, CMCTool and AnalyzeTool.",
            show_default=False,
        ),
    ],
    format: options.Format = "full",
    select: options.Select = None,
    ignore: options.Ignore = None,
    fail_on: options.FailOn = None,
    everything: options.Everything = False,
) -> None:
    """Check a finished trial against published limits: is the model strong enough, are the data good?

    The trial may come from OpenSim or from 'osimlite run'. Markers, coordinate ranges, filters, loads
    on the feet, body weight, residuals, reserve actuators, tracking errors, activations and passive
    forces are compared with their limits. Each number is good, okay (it meets only the looser of two
    limits) or bad. Findings give the file, row, source of the limit, and what to look at. Checks that
    were left out are listed with the reason. 'osimlite rule OSIM9' lists the rules.

    Exits with 0 if there are no problems, 1 if there are findings of the severity --fail-on (warning
    by default) or worse, 2 if the command could not run.

    Example: osimlite check-trial subject01
    """
    from osimlite.base.records import replace
    from osimlite.cli._console import print_for_programs, say, show, wants_colour
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._validating import check_option_values, get_terminal_width
    from osimlite.lint.diagnostic import Severity
    from osimlite.lint.reporters import FOR_PEOPLE, render
    from osimlite.tools.trials.check import check_trial as check

    check_option_values(format, fail_on)
    with progress_bar("checking", None) as progress:
        report = check(
            *paths, select=select, ignore=ignore, progress=lambda done, total: progress(done, total)
        )
    if format == "json":
        from osimlite.base.text import format_json

        print_for_programs(format_json(report.as_dict()))
    elif format not in FOR_PEOPLE:
        print_for_programs(render(report, format))
    else:
        if format == "full":
            _show_verdicts(report)
        # The table of verdicts above already lists what is okay.
        visible = (
            report if everything else replace(report, findings=report.at_least(Severity.WARNING))
        )
        width = min(max(get_terminal_width(), 40), 120)
        show(render(visible, format, colour=wants_colour(), width=width, everything=everything))
        for reason in report.unchecked:
            # A reason may end with a suggestion.
            say(f"Not checked: {reason}" if reason.endswith("?") else f"Not checked: {reason}.")
    raise SystemExit(int(bool(report.at_least(Severity(fail_on or Severity.WARNING)))))


def _show_verdicts(report: TrialReport) -> None:
    """Print the worst value of each quantity, grouped by file."""
    from itertools import groupby

    from osimlite.cli._console import add_row, create_table, print_table, say, show

    for file, verdicts in groupby(report.worst, key=lambda row: row.file):
        table = create_table()
        for column in ("result", "value", "limits", "quantity"):
            table.add_column(
                column, overflow="fold", justify="right" if column == "limits" else "left"
            )
        for row in verdicts:
            add_row(table, row.verdict, row.value_text, row.limits, row.words)
        show(f"{file}\n")
        print_table(table)
        show("\n")
    if report.verdicts:
        say("Limits: up to the first number a value is good, up to the second it is okay.")
        say()
