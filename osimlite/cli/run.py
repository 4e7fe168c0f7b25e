"""``osimlite run``: what OpenSim's tools do, by their own setup files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from osimlite.lint.diagnostic import Report
    from osimlite.tools.outcome import Outcome


@command
def run(
    setups: Annotated[list[Path], Argument(help="Setup files of tools.", show_default=False)],
    output: Annotated[
        Path | None,
        Option("-o", "--output", metavar="FOLDER", help="Folder to write into.", show_default="where the setup says"),
    ] = None,
) -> None:
    """Run setup files of OpenSim's tools, and write the files that OpenSim would write.

    A setup and all that it names are checked first, as 'osimlite validate' does; an error stops the run. Files are
    looked for from the folder of the setup, then from here. 'run-tool' is another name of this command.

    Exits with 0 if all is done, 1 if the answer of a tool is no, 2 if a setup could not be run.

    Example: osimlite run subject01_Setup_InverseDynamics.xml -o results
    """
    from osimlite.tools.running import FaultySetup
    from osimlite.tools.running import run as run_setup

    done = True
    for setup in setups:
        try:
            outcome = run_setup(setup, output)
        except FaultySetup as fault:
            _show_findings(fault.report)
            raise
        _show(setup, outcome)
        done &= outcome.done
    raise SystemExit(0 if done else 1)


def _show_findings(report: Report) -> None:
    from osimlite.cli._console import show, wants_colour
    from osimlite.lint.diagnostic import Report
    from osimlite.lint.reporters import render

    show(render(Report(report.errors, report.texts), "concise", colour=wants_colour()), err=True)


def _show(setup: Path, outcome: Outcome) -> None:
    from osimlite.cli._console import Facts

    facts = Facts(str(setup), outcome.told)
    facts.add("files", ", ".join(str(path) for path in outcome.files) or "none")
    facts.show()
