"""``osimlite validate``: say what is wrong with model files."""

from __future__ import annotations

from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def validate(
    paths: Annotated[
        list[str],
        Argument(
            metavar="PATH...",
            help="Files (.osim, .xml, .omoco, .sto, .mot, .trc), folders, or - for standard input.",
            show_default=False,
        ),
    ],
    format: options.Format = "full",
    select: options.Select = None,
    ignore: options.Ignore = None,
    fail_on: options.FailOn = None,
    fix: Annotated[bool, Option("--fix", help="Mend what can be mended with certainty.")] = False,
    unsafe_fixes: Annotated[
        bool,
        Option(
            "--unsafe-fixes",
            help="Mend also what was probably meant; look at it with --diff first.",
        ),
    ] = False,
    diff: Annotated[bool, Option("--diff", help="Show the mends and write nothing.")] = False,
    baseline: Annotated[
        str | None,
        Option(
            help="Say nothing of the findings in this file.", metavar="FILE", show_default=False
        ),
    ] = None,
    write_baseline: Annotated[
        str | None,
        Option(
            help="Write all findings to this file and stop.", metavar="FILE", show_default=False
        ),
    ] = None,
    geometry: options.Geometry = None,
    classes: Annotated[
        list[str] | None,
        Option(
            metavar="FILE",
            help="A file that declares classes of a plug-in; may be repeated.",
            show_default=False,
        ),
    ] = None,
    target_version: Annotated[
        str,
        Option(
            metavar="RELEASE",
            help="The OpenSim that is to read the files: 4.0 to 4.6 (OSIM113).",
            show_default="4.6",
        ),
    ] = "",
    everything: options.Everything = False,
    statistics: Annotated[
        bool, Option("--statistics", help="Count findings by rule instead.")
    ] = False,
    stdin_filename: Annotated[
        str | None,
        Option(
            metavar="FILE",
            help="Take standard input for what this file will be, and check it there.",
            show_default=False,
        ),
    ] = None,
    only_ours: options.OnlyOurs = False,
    no_cache: Annotated[
        bool, Option("--no-cache", help="Check every file, also those that have not changed since.")
    ] = False,
) -> None:
    """Say what is wrong with models, setups and tables: all in one run, with line, column and nearest spelling.

    Exits with 0 if all is well, 1 if there are findings as bad as --fail-on, 2 if a file cannot be
    read.

    Example: osimlite validate walker.osim --format concise
    """
    # All of it goes on under the same names.
    given = locals()
    from osimlite.cli._validating import run

    raise SystemExit(run(**given))
