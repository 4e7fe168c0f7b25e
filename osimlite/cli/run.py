"""``osimlite run``: what OpenSim's tools do, by their own setup files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.cli import _sweeping as sweeping
from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from osimlite.lint.diagnostic import Report
    from osimlite.tools.many import Trial
    from osimlite.tools.outcome import Outcome

WORTH_SHARING = 4
"""Of fewer setups, processes of their own take longer to begin than they save."""
MOST_ROWS = 40
"""Of more setups those are shown that failed, or whose markers are farthest off."""


@command
def run(
    setups: Annotated[
        list[str], Argument(help="Setup files of tools, or patterns such as 'subjects/*/ik.xml'.", show_default=False)
    ],
    output: Annotated[
        Path | None,
        Option("-o", "--output", metavar="FOLDER", help="Folder to write into.", show_default="where the setup says"),
    ] = None,
    workers: sweeping.Workers = None,
    cluster: sweeping.Cluster = None,
    resume: Annotated[bool, Option("--resume", help="Leave out what an interrupted run has done.")] = False,
    report: Annotated[
        Path | None,
        Option("--report", metavar="FILE.html", help="Show it all on one page.", show_default=False),
    ] = None,
    as_json: Annotated[bool, Option("--json", help="Print what became of each setup as JSON.")] = False,
) -> None:
    """Run setup files of OpenSim's tools, and write the files that OpenSim would write.

    A setup and all that it names are checked first, as 'osimlite validate' does; an error stops it. Files are looked
    for from the folder of the setup, then from here. 'run-tool' is another name of this command.

    Of several setups each waits for those that make what it names; one that fails stops no other. What is done is noted
    until all are, and --resume goes on after Ctrl-C, a crash or an error. With -o each has a folder of its own in it.

    Exits with 0 if all is done, 1 if the answer of a tool is no, 2 if a setup could not be run.

    Example: osimlite run scale.xml 'trials/*/ik.xml' 'trials/*/id.xml' --workers 4
    """
    from osimlite.cli._progress import progress_bar
    from osimlite.errors import SettingError
    from osimlite.tools.many import found, run_many

    files = found(setups)
    if report is not None and (as_json or resume or cluster or workers):
        raise SettingError("--report runs setups one after the other; leave out the other options of how they run")
    if report is not None or (len(files) == 1 and not as_json and not (resume or cluster)):
        raise SystemExit(_run_each(files, output, report))
    count = 1 if workers is None and cluster is None and len(files) < WORTH_SHARING else workers
    with progress_bar("running", len(files)) as progress:
        trials = run_many(
            files, output, workers=count, cluster=cluster, resume=resume, progress=lambda done, of: progress(done, of)
        )
    if as_json:
        import json

        from osimlite.cli._console import show

        show(json.dumps([vars(trial) for trial in trials], indent=2) + "\n")
    else:
        _show_trials(trials)
    raise SystemExit(max(_codes(trials), default=0))


def _codes(trials: list[Trial]) -> list[int]:
    from osimlite.tools.many import DONE, NO

    return [{DONE: 0, NO: 1}.get(trial.status, 2) for trial in trials]


def _run_each(setups: list[Path], output: Path | None, report: Path | None) -> int:
    """Run setups one after the other, and say of each what came out; the first that fails is the last."""
    from osimlite.lint.diagnostic import Report
    from osimlite.tools.many import in_order, places_of
    from osimlite.tools.running import FaultySetup
    from osimlite.tools.running import run as run_setup

    outcomes: dict[str | Path, Outcome] = {}
    places = places_of(setups, output)
    for setup in in_order(setups):
        try:
            outcomes[setup] = run_setup(setup, places[setup], tell=_show_findings)
        except FaultySetup as fault:
            _show_findings(Report(fault.report.errors, fault.report.texts))
            raise
        _show(setup, outcomes[setup])
    if report is not None:
        from osimlite.cli._console import say
        from osimlite.view.report import report as write_report

        say(f"wrote {write_report(outcomes, report)}")
    return 0 if all(outcome.done for outcome in outcomes.values()) else 1


def _show_findings(report: Report) -> None:
    from osimlite.cli._console import show, wants_colour
    from osimlite.lint.reporters import render

    show(render(report, "concise", colour=wants_colour()), err=True)


def _show(setup: Path, outcome: Outcome) -> None:
    from osimlite.cli._console import Facts
    from osimlite.text import counted

    facts = Facts(str(setup), outcome.told)
    if outcome.warnings:
        facts.add("check", f"{counted(outcome.warnings, 'warning')}; see them with: osimlite validate {setup}")
    facts.add("files", ", ".join(str(path) for path in outcome.files) or "none")
    facts.show()


def _show_trials(trials: list[Trial]) -> None:
    from collections import Counter

    from osimlite.cli._console import add_row, plain_console, plain_table, show
    from osimlite.text import counted
    from osimlite.tools.many import STATUSES

    shown = trials
    if len(trials) > MOST_ROWS:
        worst = sorted(trials, key=lambda trial: (_codes([trial])[0], trial.summary.get("rms_marker_error", 0.0)))
        shown = worst[-MOST_ROWS:][::-1]
    table = plain_table()
    for column in ("setup", "", "s", ""):
        table.add_column(column, overflow="fold", justify="right" if column == "s" else "left")
    for trial in shown:
        words = trial.message or "; ".join(f"{name} {said}" for name, said in trial.told[:2])
        seconds = "" if trial.was_done else f"{trial.seconds:.2f}"
        add_row(table, trial.setup, trial.status + (", before" if trial.was_done else ""), seconds, words)
    plain_console().print(table)
    counts = Counter(trial.status for trial in trials)
    told = ", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status])
    more = f" ({len(shown)} shown: those that failed or whose markers are farthest off)" if shown is not trials else ""
    show(f"{counted(len(trials), 'setup')}: {told}{more}\n")
