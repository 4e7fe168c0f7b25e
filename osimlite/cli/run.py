"""``osimlite run``: run OpenSim's tools by their own setup files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.cli import _sweeping as sweeping
from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from collections.abc import Mapping

    from osimlite.lint.diagnostic import Report
    from osimlite.tools.many import RunRecord
    from osimlite.tools.outcome import Outcome

MIN_PARALLEL_SETUPS = 4
"""Number of setups from which on several processes are worth their start."""
MOST_WARNINGS = 3
"""Number of warnings that are shown of a single setup, besides those with a suggestion."""
MOST_ROWS = 40
"""Largest number of setups in the table; of more, the worst are shown."""


@command
def run(
    setups: Annotated[
        list[str],
        Argument(
            help="Setup files of tools, or patterns such as 'subjects/*/ik.xml'.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder to write into.",
            show_default="the folder in the setup",
        ),
    ] = None,
    workers: sweeping.Workers = None,
    cluster: sweeping.Cluster = None,
    resume: Annotated[bool, Option("--resume", help="Continue an interrupted run.")] = False,
    report: Annotated[
        Path | None,
        Option(
            "--report",
            metavar="FILE.html",
            help="Write a page with all results.",
            show_default=False,
        ),
    ] = None,
    plot: Annotated[
        bool,
        Option(
            "--plot",
            help="Draw every table as PNG, at most 12 panels a page, into a folder <setup>-plots.",
        ),
    ] = False,
    refine: Annotated[
        str | None,
        Option(
            "--refine",
            metavar="TOL[:HESSIAN]",
            help="For one Moco study: refine the mesh until the error of every interval is at most TOL. "
            "HESSIAN is exact (the default) or limited-memory.",
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[
        bool, Option("--json", help="Print the result of each setup as JSON.")
    ] = False,
    overwrite: Annotated[
        bool,
        Option(
            "--overwrite", help="Let results replace any file, not only results of the same type."
        ),
    ] = False,
    write_outside: Annotated[
        bool,
        Option(
            "--write-outside",
            help="Let setups write outside their project and the current folder.",
        ),
    ] = False,
) -> None:
    """Run setup files of OpenSim's tools, and write the files that OpenSim would write.

    A setup and the files that it names are checked first, as by 'osimlite validate'; it does not run
    if they have an error with which OpenSim would not run either. A file name is looked up in the
    folder of the setup, then in the current folder. 'run-tool' is another name of this command.

    A setup waits for the setups that write its input files. If one fails, only those that need it
    are skipped. Finished setups are recorded, and --resume continues after Ctrl-C, a crash or an
    error. With -o each of several setups has its own subfolder.

    A result replaces an existing file only if that is a result of the same type. Results are not
    written through links, under hidden names, or outside both the current folder and the project of
    the setup, which is the nearest folder above it with .git, osimlite.toml or pyproject.toml. See
    --overwrite and --write-outside.

    For a Moco study, --report also simulates the solution, and reports how far simulation and
    solution differ.

    Exits with 0 if all setups are done, 1 if a tool found no solution, 2 if a setup could not run.

    Example: osimlite run scale.xml 'trials/*/ik.xml' 'trials/*/id.xml' --workers 4
    """
    import warnings

    from osimlite.base.files import expect_folder_of
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import require_plots
    from osimlite.errors import ResultWarning, SettingError
    from osimlite.tools.many import assign_folders, find_setups, run_many
    from osimlite.tools.named_files import find_inputs

    # The messages of each outcome contain these warnings.
    warnings.simplefilter("ignore", ResultWarning)
    require_plots(plot=plot)
    files = find_setups(setups)
    for option in (["--report"] if report is not None else []) + (["--plot"] if plot else []):
        # Pictures and reports need the outcomes in this process, which workers do not send back.
        if resume or cluster or workers not in (None, 1):
            raise SettingError(
                f"{option} runs setups one after the other; leave out --workers, --cluster and --resume"
            )
        workers = 1
    if report is not None:
        expect_folder_of(report)
        # The report must not replace a file that it describes.
        if any(find_inputs([report], setup) for setup in files):
            raise SettingError(
                f"--report would replace '{report}', a setup or one of its input files; give the report another name"
            )
    # One setup is shown in full; several get a row each.
    if len(files) == 1 and not as_json and not (resume or cluster):
        outcome = _run_alone(
            files[0],
            output,
            refine,
            simulates=report is not None,
            overwrite=overwrite,
            write_outside=write_outside,
        )
        _write_report({files[0]: outcome}, report)
        if plot:
            _draw_outcome(files[0], outcome, output, Path(output or ""))
        raise SystemExit(0 if outcome.done else 1)
    if refine is not None:
        raise SettingError(
            "--refine takes one study; leave out the others, --json, --resume and --cluster"
        )
    # Outcomes hold all tables: they are kept only if something is drawn from them.
    outcomes: dict[str | Path, Outcome] | None = {} if report is not None or plot else None
    # Starting processes for few setups takes longer than running them.
    count = (
        1 if workers is None and cluster is None and len(files) < MIN_PARALLEL_SETUPS else workers
    )
    with progress_bar("running", len(files)) as progress:
        trials = run_many(
            files,
            output,
            workers=count,
            cluster=cluster,
            resume=resume,
            progress=lambda done, total: progress(done, total),
            outcomes=outcomes,
            overwrite=overwrite,
            write_outside=write_outside,
        )
    if as_json:
        import json

        from osimlite.cli._console import show

        show(json.dumps([vars(trial) for trial in trials], indent=2) + "\n")
    else:
        _show_trials(trials)
    if outcomes:
        _write_report(outcomes, report, err=as_json)
        # Like the results, pictures mirror the folders of the setups: trials often have setups of
        # the same name.
        folders = assign_folders(files, output or Path())
        for setup, outcome in outcomes.items() if plot else ():
            folder = folders[Path(setup)] or Path()
            _draw_outcome(
                Path(setup),
                outcome,
                output,
                folder.parent if len(files) > 1 else folder,
                err=as_json,
            )
    raise SystemExit(max(_list_exit_codes(trials), default=0))


def _list_exit_codes(trials: list[RunRecord]) -> list[int]:
    from osimlite.tools.many import DONE, NO

    # Exit code 2: the setup could not be run; 1: it ran, and its tool reported a failure.
    return [{DONE: 0, NO: 1}.get(trial.status, 2) for trial in trials]


def _run_alone(
    setup: Path,
    output: Path | None,
    refine: str | None,
    *,
    simulates: bool,
    overwrite: bool,
    write_outside: bool,
) -> Outcome:
    """Run a setup, and print its messages.

    Returns:
        Outcome of the tool.

    Raises:
        DocumentError: the check of the setup found errors.
        SystemExit: the setup could not run for another reason, which has been printed (exit code
            2).
    """
    import sys

    from osimlite.cli._console import complain, say
    from osimlite.cli._progress import progress_bar
    from osimlite.errors import DocumentError, OsimliteError
    from osimlite.lint.diagnostic import Report
    from osimlite.tools.running import FaultySetup
    from osimlite.tools.running import run as run_setup

    try:
        with progress_bar("running", None) as advance:
            outcome = run_setup(
                setup,
                output,
                tell=_show_findings,
                # A terminal shows the last iteration of a search, a log all of them.
                progress=(lambda line: advance(0, None, line))
                if sys.stderr.isatty()
                else (lambda line: say(line, err=True)),
                refine=refine,
                simulates=simulates,
                overwrite=overwrite,
                write_outside=write_outside,
            )
    except FaultySetup as fault:
        # Only the errors: warnings do not stop a setup. The message of the exception would repeat
        # the first of them.
        errors = fault.report.errors
        _show_findings(Report(errors, fault.report.texts))
        errors_text = "this error" if len(errors) == 1 else "these errors"
        raise DocumentError(f"did not run because of {errors_text}", file=str(setup)) from None
    except OsimliteError as error:
        # As for several setups: the setup could not run, also if the reason is in the model.
        complain(error)
        raise SystemExit(2) from None
    _print_outcome(setup, outcome)
    # Ipopt's status after Ctrl-C.
    if outcome.summary.get("status") == "User_Requested_Stop":
        complain("interrupted; the files contain the best iteration")
    return outcome


def _write_report(
    outcomes: Mapping[str | Path, Outcome], report: Path | None, *, err: bool = False
) -> None:
    from osimlite.cli._console import say

    if report is not None:
        from osimlite.base.files import make_folder_of
        from osimlite.tools.report import report as write_report

        make_folder_of(report)

        say(f"wrote {write_report(outcomes, report)}", err=err)


def _draw_outcome(
    setup: Path, outcome: Outcome, output: Path | None, parent: Path, *, err: bool = False
) -> None:
    """Draw the tables of a setup into a folder that is named after it.

    Args:
        setup: path of the setup.
        outcome: results of the setup.
        output: folder of all results; None if the setups name theirs.
        parent: folder in which the folder of the pictures is made.
        err: whether to report on standard error.
    """
    from osimlite.base.writing import expect_folder_inside
    from osimlite.cli._recorded import draw_tables
    from osimlite.mechanics.multibody import build_mechanism

    if not outcome.tables:
        return
    folder = parent / f"{setup.stem}-plots"
    # Pictures into a folder that the user did not name must stay inside the current one.
    if output is None:
        expect_folder_inside(folder)
    evidence = outcome.evidence
    model = None if evidence is None else evidence.model
    mechanism = None if model is None else build_mechanism(model)
    loads = None if evidence is None else evidence.loads
    draw_tables(outcome.tables, folder, model, mechanism, loads, err=err)


def _show_findings(report: Report) -> None:
    from osimlite.cli._console import show, wants_colour
    from osimlite.lint.reporters import render

    show(render(report, "concise", colour=wants_colour()), err=True)


def _print_outcome(setup: Path, outcome: Outcome) -> None:
    from osimlite.base.text import format_count
    from osimlite.cli._console import FactTable

    facts = FactTable(str(setup), outcome.messages)
    # Findings with a suggestion were shown before the run.
    unreported = [finding for finding in outcome.warnings if finding.suggestion is None]
    for finding in unreported[:MOST_WARNINGS]:
        facts.add("check", str(finding))
    if (hidden_count := len(unreported) - MOST_WARNINGS) > 0:
        files = " ".join(dict.fromkeys(finding.file or str(setup) for finding in unreported))
        facts.add(
            "check",
            f"{format_count(hidden_count, 'more warning')}; see them with: osimlite validate {files}",
        )
    facts.add_files(outcome.files)
    facts.show()


def _show_trials(trials: list[RunRecord]) -> None:
    from collections import Counter

    from osimlite.base.text import format_count
    from osimlite.cli._console import show, show_rows
    from osimlite.fitting.fit_messages import RECOMMENDS
    from osimlite.tools.many import STATUSES

    visible_trials = trials
    if len(trials) > MOST_ROWS:
        worst = sorted(
            trials,
            key=lambda trial: (
                _list_exit_codes([trial])[0],
                trial.summary.get("rms_marker_error", 0.0),
            ),
        )
        # The worst come first in the table.
        visible_trials = worst[-MOST_ROWS:][::-1]
    rows = []
    for trial in visible_trials:
        # The first messages, and those about errors that exceed a recommended limit.
        messages = [
            message
            for index, message in enumerate(trial.messages)
            if index < 2 or RECOMMENDS in message[1]
        ]
        result_text = trial.failure or "; ".join(f"{name}: {fact}" for name, fact in messages)
        if trial.warnings:
            remark = (
                f"; and {format_count(len(trial.warnings) - 1, 'more warning')}"
                if len(trial.warnings) > 1
                else ""
            )
            result_text = f"{result_text}; {trial.warnings[0]}{remark}"
        # A setup that a former run did has no time of this run.
        seconds = "" if trial.was_done else f"{trial.seconds:.2f} s"
        status = trial.status + (", before" if trial.was_done else "")
        rows.append((trial.setup, status, seconds, result_text))
    show_rows(("setup", "state", "time", "result"), rows, right_aligned=(2,))
    counts = Counter(trial.status for trial in trials)
    status_text = ", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status])
    if warning_count := sum(1 for trial in trials if trial.warnings):
        status_text += f", {warning_count} with warnings"
    remark = (
        f" ({len(visible_trials)} shown: those that failed or whose markers are farthest off)"
        if visible_trials is not trials
        else ""
    )
    show(f"{format_count(len(trials), 'setup')}: {status_text}{remark}\n")
