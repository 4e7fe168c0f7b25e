"""Running a setup: it is checked, its tool is found and run, and what came out is written."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from osimlite.base.files import get_relative_path
from osimlite.base.text import format_count, join_words
from osimlite.base.writing import ResultWriter
from osimlite.errors import DocumentError, MissingFileError, OsimliteError, SettingError
from osimlite.io.document.reader import collector_paused, read_any
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Finding, Report, merged
from osimlite.lint.engine import run as checked
from osimlite.lint.engine import subject_of
from osimlite.lint.many import settings_of
from osimlite.lint.project_files import is_table
from osimlite.lint.rules.values import KEEPS_DEFAULT
from osimlite.lint.setup import Setup
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.schema.base import Object
from osimlite.schema.registry import MODULES
from osimlite.schema.specs import file_specs
from osimlite.tools.job import Job, NotRunnable
from osimlite.tools.named_files import expect_few, read_subject
from osimlite.tools.outcome import Outcome
from osimlite.tools.registry import TOOLS, import_function

IGNORED = ("OSIM101",)
"""Errors that OpenSim runs a setup with: properties that it does not know, such as those of other versions."""
DEFAULTED = ("OSIM201", "OSIM202")
"""Errors of values that OpenSim cannot read; it runs a setup with those of which it keeps the default."""

STUDY = ".omoco"
NO_OPTION = " there, or take it out of the model"
"""What is said in place of advice on an option that `run` does not have."""


class FaultySetup(DocumentError):
    """A setup, or what it names, has errors.

    Attributes:
        report: all that was found.
    """

    def __init__(self, report: Report) -> None:
        first, *others = report.errors
        more = f"; and {format_count(len(others), 'error')} more" if others else ""
        super().__init__(
            f"{first.message}{more}", file=first.file, line=first.line, column=first.column
        )
        self.report = report


@collector_paused()
@any_numbers
def run(
    setup: str | Path,
    output: str | Path | None = None,
    *,
    check: bool = True,
    tell: Callable[[Report], None] | None = None,
    progress: Callable[[str], None] | None = None,
    refine: float | str | None = None,
    simulates: bool = False,
    overwrite: bool = False,
    write_outside: bool = False,
    substitutes: Mapping[str, str] | None = None,
) -> Outcome:
    """Run the setup of a tool as OpenSim would, and write the files that it would write.

    Args: setup: the file. output: a folder for all results, in place of where the setup puts them.
        check: whether the setup and all that it names but the model are checked first. tell: is
        told, before anything is computed, what is misspelt although the tool runs with it, such as
        a marker or a sensor that is left out then, or the units of a table. progress: is told, line
        by line, how far a long search has come. refine: of optimal control, split intervals of the
        mesh until the error of none is above this; see :func:`osimlite.moco.solve`. simulates: of
        optimal control, whether the model is also simulated with the controls that were found, and
        it is told how far that is from what was found. overwrite: whether any file may be replaced;
        without it only results of the same kind are. write_outside: whether the setup may name
        results outside of its project and the current folder. substitutes: by absolute path of an
        input that the setup names, the path of the file that is read instead.

    Returns: The tables that were written, as they were before they were rounded to the digits of
        the files, and a summary.

    Raises:
        FaultySetup: the check found errors.
        UnsupportedError: the document is not of a tool that can be run.
        OsimliteError: it could not be carried out; nothing is written then.
    """
    if not isinstance(setup, str | os.PathLike):
        raise OsimliteError(f"the file of a setup is wanted here, not a {type(setup).__name__}")
    file = Path(setup)
    top = read_any(file)
    tag = type(top).__name__
    if tag not in TOOLS:
        raise NotRunnable(
            f"setups of {tag} cannot be run; those of {join_words(runnable())} can", file=str(file)
        )
    if refine is not None and not tag.startswith("Moco"):
        raise SettingError(f"a {tag} has no mesh to refine; leave out --refine")
    outcome = Outcome(progress=progress)
    replaced = substitute_inputs(top, file.parent, substitutes or {})
    if check:
        away: dict[str, None] = {}
        report = merged(_reports(str(file), away))
        if errors := [
            e for e in report.errors if not (_is_run_by_opensim(e) or _is_about_any(e, replaced))
        ]:
            raise FaultySetup(Report(errors, report.texts))
        if away:
            outcome.tell("taken from here", f"{join_words(away)}, not beside the setup")
        outcome.warnings = sorted(
            report.errors + report.warnings, key=lambda found: found.suggestion is None
        )
        misspelt = [found for found in outcome.warnings if found.suggestion is not None]
        if tell is not None and misspelt:
            tell(Report(misspelt, report.texts))
    run_tool = import_function(TOOLS[tag])
    writer = ResultWriter.for_document(file, output, overwrite=overwrite, outside=write_outside)
    try:
        folder = None if output is None else Path(output)
        run_tool(Job(top, file, folder, refine, simulates), outcome)
        outcome.write(file, writer)
    except OsimliteError as error:
        from osimlite.simulation.elements.gather import SKIP_ADVICE

        error.message = error.message.replace(SKIP_ADVICE, NO_OPTION)
        error.file = error.file or str(file)
        subject = subject_of(str(file), Config()) if isinstance(error, MissingFileError) else None
        if isinstance(subject, Setup) and (maker := subject.writer_of(error.file)) is not None:
            error.message += (
                f"; run '{get_relative_path(maker, Path.cwd())}' first, which should make it"
            )
        raise
    return outcome


def substitute_inputs(top: Object, folder: Path, substitutes: Mapping[str, str]) -> list[str]:
    """Replace the names of some input files in a document.

    Args:
        top: the document, which is changed.
        folder: that its paths go from.
        substitutes: by absolute path of an input, that of the file in its place.

    Returns:
        The names that were replaced, as the document had them.
    """
    replaced: list[str] = []

    def substitute(name: str) -> str:
        new = substitutes.get(os.path.realpath(folder / name.strip())) if name.strip() else None
        if new is None:
            return name
        replaced.append(name.strip())
        return new

    for item in top.walk() if substitutes else ():
        for spec in file_specs(type(item), "file"):
            value = getattr(item, spec.name)
            if isinstance(value, str):
                setattr(item, spec.name, substitute(value))
            elif isinstance(value, tuple):
                setattr(item, spec.name, tuple(substitute(str(name)) for name in value))
    return replaced


def _is_about_any(error: Finding, names: Sequence[str]) -> bool:
    """Return whether an error is about an input that is replaced, and so does not matter."""
    own = os.path.basename(error.file or "")
    return any(f"'{name}'" in error.message or own == os.path.basename(name) for name in names)


def _is_run_by_opensim(error: Finding) -> bool:
    """Return whether OpenSim runs a setup in spite of an error, with a property at its default.

    A study of Moco, which is searched for long, should have none of these.
    """
    if Path(error.file or "").suffix == STUDY:
        return False
    return error.code in IGNORED or (error.code in DEFAULTED and KEEPS_DEFAULT in error.message)


def runnable() -> list[str]:
    """The names of the classes whose setups can be run."""
    return [tag for tag in MODULES if tag in TOOLS]


def _reports(setup: str, away: dict[str, None]) -> Iterator[Report]:
    """Yield what is wrong with a document and with those and the tables that it names, each once, but not models.

    Files that are in the current folder, and not in that of the document that names them, are noted
    in `away`.
    """
    waiting, visited = deque([setup]), {os.path.realpath(setup)}
    while waiting:
        file = waiting.popleft()
        subject = subject_of(file, settings_of(file).config_for(file, Config()))
        read_subject.keep(file, subject)
        yield checked(subject, measure=False)
        if not isinstance(subject, Setup):
            continue
        named: list[str] = []
        for naming in subject.named_files("file"):
            path = naming.path
            if not os.path.isfile(path):
                continue
            if path == naming.name.strip() and not os.path.isabs(path):
                away[path] = None
            real = os.path.realpath(path)
            if real not in visited and (is_table(path) or path.lower().endswith(".xml")):
                visited.add(real)
                expect_few(visited, setup)
                named.append(path)
        # What a document names is reported before what its neighbours name.
        waiting.extendleft(reversed(named))
