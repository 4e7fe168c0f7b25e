"""``osimlite check-trial``: is a finished trial good enough?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from osimlite.tools.trials.check import TrialReport


@command
def check_trial(
    paths: Annotated[
        list[str],
        Argument(
            metavar="PATH...",
            help="Folders with setups and what these wrote, or setups of ScaleTool, InverseKinematicsTool, "
            "InverseDynamicsTool, RRATool, CMCTool and AnalyzeTool.",
            show_default=False,
        ),
    ],
    format: Annotated[
        str, Option("--format", metavar="FORMAT", help="full, concise, json, github, sarif or junit.")
    ] = "full",
    select: Annotated[
        list[str] | None,
        Option(
            metavar="RULE", help="Run only these rules: codes, beginnings of codes (OSIM3), names.", show_default=False
        ),
    ] = None,
    ignore: Annotated[
        list[str] | None,
        Option(metavar="RULE", help="Leave these rules out; as for --select.", show_default=False),
    ] = None,
    fail_on: Annotated[
        str | None,
        Option(metavar="SEVERITY", help="What makes the exit code 1: error, warning or info.", show_default=False),
    ] = None,
    everything: Annotated[
        bool, Option("--all", help="Print every finding; else the first stands for those that are like it.")
    ] = False,
) -> None:
    """Say whether a finished trial is good enough: is the model strong enough, are the data good?

    Made by OpenSim or by 'osimlite run': markers, ranges, filters, feet and weight under the loads, residuals, reserve
    actuators, errors of tracking, activations and passive forces are compared with published limits. Each number is
    shown with its limits: good, okay (beyond the stricter of two) or bad; findings say where, by which source and what
    to look at. What could not be looked at is told with the reason. 'osimlite rule OSIM9' lists the rules.

    Exits with 0 if all is well, 1 if there are findings as bad as --fail-on, which is warning here, 2 if it could not
    be carried out.

    Example: osimlite check-trial subject01
    """
    from osimlite.cli._console import hand_over, show, wants_colour
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._validating import terminal_width
    from osimlite.errors import OsimliteError
    from osimlite.lint.diagnostic import Severity
    from osimlite.lint.reporters import FOR_PEOPLE, FORMATS, render
    from osimlite.records import replace
    from osimlite.text import listed
    from osimlite.tools.trials.check import check_trial as check

    if fail_on is not None and fail_on not in tuple(Severity):
        raise OsimliteError(f"--fail-on is one of {listed(Severity)}, not '{fail_on}'")
    if format not in FORMATS:
        raise OsimliteError(f"--format is one of {listed(FORMATS)}, not '{format}'")
    with progress_bar("checking", None) as progress:
        report = check(*paths, select=select, ignore=ignore, progress=lambda done, of: progress(done, of))
    if format == "json":
        from osimlite.text import json_lines

        hand_over(json_lines(report.as_dict()))
    elif format not in FOR_PEOPLE:
        hand_over(render(report, format))
    else:
        if format == "full":
            _show_verdicts(report)
        # The table has what is okay.
        told = report if everything else replace(report, findings=report.at_least(Severity.WARNING))
        width = min(max(terminal_width(), 40), 120)
        show(render(told, format, colour=wants_colour(), width=width, everything=everything))
        for why in report.unchecked:
            show(f"Not looked at: {why}.\n")
    raise SystemExit(int(bool(report.at_least(Severity(fail_on or Severity.WARNING)))))


def _show_verdicts(report: TrialReport) -> None:
    """The worst number of each kind, by files."""
    from itertools import groupby

    from osimlite.cli._console import add_row, plain_console, plain_table, show

    for file, verdicts in groupby(report.worst, key=lambda verdict: verdict.file):
        table = plain_table()
        for column in ("", "", "limits", ""):
            table.add_column(column, overflow="fold", justify="right" if column == "limits" else "left")
        for verdict in verdicts:
            add_row(table, verdict.verdict, verdict.shown, verdict.limits, verdict.words)
        show(f"{file}\n")
        plain_console().print(table)
        show("\n")
