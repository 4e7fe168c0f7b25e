"""``osimlite validate``: report errors in models, setups and tables."""

from __future__ import annotations

from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def validate(
    paths: Annotated[
        list[str],
        Argument(
            metavar="PATH",
            help="Files (.osim, .xml, .omoco, .sto, .mot, .trc), folders, or - for standard input.",
            show_default=False,
        ),
    ],
    format: options.Format = "full",
    select: options.Select = None,
    ignore: options.Ignore = None,
    fail_on: options.FailOn = None,
    fix: Annotated[bool, Option("--fix", help="Apply the safe fixes.")] = False,
    unsafe_fixes: Annotated[
        bool,
        Option(
            "--unsafe-fixes",
            help="Apply the safe and the probable fixes; check them with --diff first.",
        ),
    ] = False,
    diff: Annotated[bool, Option("--diff", help="Show the fixes and write nothing.")] = False,
    baseline: Annotated[
        str | None,
        Option(help="Do not report findings in this baseline.", metavar="FILE", show_default=False),
    ] = None,
    write_baseline: Annotated[
        str | None,
        Option(
            help="Write all findings to a baseline and exit.", metavar="FILE", show_default=False
        ),
    ] = None,
    geometry: options.Geometry = None,
    classes: Annotated[
        list[str] | None,
        Option(
            metavar="FILE",
            help="A file that describes classes of a plug-in; may be repeated.",
            show_default=False,
        ),
    ] = None,
    target_version: Annotated[
        str,
        Option(
            metavar="RELEASE",
            help="Release of OpenSim that will read the files: 4.0 to 4.6 (OSIM113).",
            show_default="4.6",
        ),
    ] = "",
    everything: options.Everything = False,
    statistics: Annotated[
        bool, Option("--statistics", help="Print the number of findings of each rule instead.")
    ] = False,
    stdin_filename: Annotated[
        str | None,
        Option(
            metavar="FILE",
            help="Check standard input in place of this file, for editors with unsaved text.",
            show_default=False,
        ),
    ] = None,
    only_ours: options.OnlyOurs = False,
    no_cache: Annotated[
        bool, Option("--no-cache", help="Check every file, also unchanged ones.")
    ] = False,
) -> None:
    """Find errors in models, setups and tables, with line, column and the nearest spelling.

    Exits with 0 if there are no problems, 1 if there are findings of the severity --fail-on or worse,
    2 if a file cannot be read.

    Example: osimlite validate walker.osim --format concise
    """
    # Pass all options on under the same names.
    options_by_name = locals()
    from osimlite.cli._validating import validate_paths

    raise SystemExit(validate_paths(**options_by_name))
