"""Running of a setup: check it, carry out its tool, and write the results."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from osimlite.base.files import get_relative_path
from osimlite.base.progress import report_stage
from osimlite.base.result_writing import ResultWriter
from osimlite.base.text import add_article, format_count, join_words
from osimlite.errors import (
    DocumentError,
    MissingFileError,
    ModelError,
    OsimliteError,
    SettingError,
)
from osimlite.io.document.cache import keep_object
from osimlite.io.document.reader import pause_collector, read_any
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Finding, Report, merge_reports
from osimlite.lint.engine import load_subject
from osimlite.lint.engine import run_rules as checked
from osimlite.lint.many import find_settings
from osimlite.lint.project_files import is_table
from osimlite.lint.rules.values import KEEPS_DEFAULT
from osimlite.lint.setup import Setup
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.schema.base import Object
from osimlite.schema.registry import MODULES
from osimlite.schema.specs import get_file_specs
from osimlite.tools.job import Job, NotRunnable
from osimlite.tools.named_files import limit_documents, read_subject
from osimlite.tools.outcome import Outcome
from osimlite.tools.registry import TOOLS, import_function

IGNORED = ("OSIM101",)
"""Errors with which OpenSim runs a setup: unknown properties, such as those of other versions."""
DEFAULTED = ("OSIM201", "OSIM202")
"""Errors about unreadable values; OpenSim runs the setup if it uses the default instead."""

STUDY = ".omoco"
"""Suffix of Moco studies."""


class FaultySetup(DocumentError):
    """Error for a setup, or a file that it names, with findings of severity error.

    Attributes:
        report: findings of the check, of any severity.
    """

    def __init__(self, report: Report) -> None:
        first_error, *other_errors = report.errors
        count_note = (
            f"; and {format_count(len(other_errors), 'more error')}" if other_errors else ""
        )
        super().__init__(
            f"{first_error.message}{count_note}",
            file=first_error.file,
            line=first_error.line,
            column=first_error.column,
        )
        self.report = report


@pause_collector()
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
    """Run the setup of a tool as OpenSim would, and write the files that OpenSim would write.

    Args:
        setup: path of the setup file.
        output: folder for all results, instead of the folders that the setup names.
        check: whether to check the setup and all files that it names, apart from the model, first.
        tell: function that receives findings with a suggestion before the tool starts, for example
            about a marker that the tool ignores because of its spelling, or about the units of a
            table.
        progress: function that receives lines about the progress of a long search.
        refine: largest error of a solution of optimal control, above which mesh intervals are
            split; see :func:`osimlite.moco.solve`. None: no refinement.
        simulates: whether to simulate the model with the controls of a solution of optimal control,
            and report how far the simulation is from the solution.
        overwrite: whether to replace any file; by default only results of the same kind are
            replaced.
        write_outside: whether the setup may name results outside its project and the current
            folder.
        substitutes: paths of files to read instead of inputs of the setup, by absolute path of the
            input.

    Returns:
        The written tables, before rounding to the digits of the files, and a summary.

    Raises:
        FaultySetup: the check found errors.
        NotRunnable: osimlite has no tool for the class of the document.
        SettingError: `refine` is given, but the tool has no mesh.
        OsimliteError: the tool failed; then it has written nothing.
    """
    if not isinstance(setup, str | os.PathLike):
        raise OsimliteError(
            f"expected the path of a setup file, found {add_article(type(setup).__name__)}"
        )
    file = Path(setup)
    setup_object = read_any(file)
    class_name = type(setup_object).__name__
    if class_name not in TOOLS:
        raise NotRunnable(
            f"osimlite cannot run {add_article(class_name)}; it runs "
            f"{join_words(list_runnable(), max_count=20)}",
            file=str(file),
        )
    # An option without effect would suggest results that it does not give.
    if refine is not None and not class_name.startswith("Moco"):
        raise SettingError(
            f"{add_article(class_name)} has no mesh to refine; leave out the refinement"
        )
    outcome = Outcome(progress=progress)
    replaced = substitute_inputs(setup_object, file.parent, substitutes or {})
    # Errors are cheaper to find before a tool that may run for hours.
    if check:
        report_stage("checking the setup")
        current_folder_files: dict[str, None] = {}
        report = merge_reports(check_documents(str(file), current_folder_files))
        # OpenSim runs setups with some errors, and errors about replaced inputs do not matter.
        if errors := [
            e for e in report.errors if not (_is_run_by_opensim(e) or _is_about_any(e, replaced))
        ]:
            raise FaultySetup(Report(errors, report.texts))
        if current_folder_files:
            outcome.add_message(
                "current folder",
                "these files were read in the current folder, because the folder of the setup does not contain them: "
                f"{join_words(current_folder_files)}",
            )
        outcome.warnings = sorted(
            report.errors + report.warnings, key=lambda finding: finding.suggestion is None
        )
        misspelt = [finding for finding in outcome.warnings if finding.suggestion is not None]
        if tell is not None and misspelt:
            tell(Report(misspelt, report.texts))
    run_tool = import_function(TOOLS[class_name])
    writer = ResultWriter.for_document(file, output, overwrite=overwrite, outside=write_outside)
    job = Job(setup_object, file, None if output is None else Path(output), refine, simulates)
    try:
        report_stage(f"{class_name}: computing")
        run_tool(job, outcome)
        report_stage(f"{class_name}: writing results")
        outcome.write(file, writer)
    except OsimliteError as error:
        # Importing the simulation here keeps setups that need none fast.
        from osimlite.simulation.elements.gather import REMOVAL_ADVICE, SKIP_ADVICE

        # ForwardTool runs a simulation, whose options this function lacks.
        error.message = error.message.replace(SKIP_ADVICE, REMOVAL_ADVICE)
        if isinstance(error, ModelError) and not error.file:
            # The rules for models were not applied; they find more faults, with their positions.
            model_name = str(getattr(setup_object, "model_file", ""))
            if (model_path := job.resolve_name(model_name)) is not None:
                shown_path = get_relative_path(str(model_path), Path.cwd())
                error.message += f"; 'osimlite validate {shown_path}' checks the model"
        error.file = error.file or str(file)
        subject = load_subject(str(file), Config()) if isinstance(error, MissingFileError) else None
        if (
            isinstance(subject, Setup)
            and (writing_setup := subject.find_writer(error.file)) is not None
        ):
            error.message += f"; run '{get_relative_path(writing_setup, Path.cwd())}' first, which writes this file"
        raise
    return outcome


def substitute_inputs(
    setup_object: Object, folder: Path, substitutes: Mapping[str, str]
) -> list[str]:
    """Replace the names of some input files in a document.

    Args:
        setup_object: object of the document; it is changed in place.
        folder: folder from which the paths in the document start.
        substitutes: paths of the replacements, by absolute path of the input.

    Returns:
        The replaced names, as they stood in the document.
    """
    replaced: list[str] = []

    def substitute(name: str) -> str:
        new = substitutes.get(os.path.realpath(folder / name.strip())) if name.strip() else None
        if new is None:
            return name
        replaced.append(name.strip())
        return new

    for component in setup_object.walk() if substitutes else ():
        for spec in get_file_specs(type(component), "file"):
            value = getattr(component, spec.name)
            if isinstance(value, str):
                setattr(component, spec.name, substitute(value))
            elif isinstance(value, tuple):
                setattr(component, spec.name, tuple(substitute(str(name)) for name in value))
    return replaced


def _is_about_any(error: Finding, names: Sequence[str]) -> bool:
    """Return whether an error is about a replaced input, and therefore does not matter."""
    file_name = os.path.basename(error.file or "")
    return any(
        f"'{name}'" in error.message or file_name == os.path.basename(name) for name in names
    )


def _is_run_by_opensim(error: Finding) -> bool:
    """Return whether OpenSim runs a setup despite an error, with the default of the property.

    Moco studies run for a long time, so they must have no such error.
    """
    if Path(error.file or "").suffix == STUDY:
        return False
    return error.code in IGNORED or (error.code in DEFAULTED and KEEPS_DEFAULT in error.message)


def list_runnable() -> list[str]:
    """Return the names of the classes whose setups osimlite can run."""
    return [class_name for class_name in MODULES if class_name in TOOLS]


def check_documents(setup: str, current_folder_files: dict[str, None]) -> Iterator[Report]:
    """Yield reports on a document and on documents and tables that it names, without models.

    Args:
        setup: path of the document.
        current_folder_files: mapping to which files are added that are in the current folder, but not in
            the folder of the document that names them.
    """
    waiting = deque([setup])
    visited = {os.path.realpath(setup)}
    loaded: dict[str, CheckTarget] = {}
    while waiting:
        file = waiting.popleft()
        subject = loaded.pop(file, None) or _load_subject(file)
        if not isinstance(subject, Setup):
            yield checked(subject, measure=False)
            continue
        document_paths: list[str] = []
        for naming in subject.find_named_files("file"):
            path = naming.path
            if not os.path.isfile(path):
                continue
            # The file was found relative to the current folder, not to that of the document.
            if path == naming.name.strip() and not os.path.isabs(path):
                current_folder_files[path] = None
            real = os.path.realpath(path)
            if real not in visited and (is_table(path) or path.lower().endswith(".xml")):
                visited.add(real)
                limit_documents(visited, setup)
                # Reports show the path of a file in the current folder without "./".
                document_paths.append(path.removeprefix(f"{os.curdir}{os.sep}"))
        # Rules about a document read the documents that it names: these are read once, for both. Plug-in
        # classes are those of the document that was loaded last.
        for path in document_paths:
            if not is_table(path) and _find_config(path).classes == subject.config.classes:
                loaded[path] = _load_subject(path)
        yield checked(subject, measure=False)
        # Depth first: files that a document names come before those of the next document.
        waiting.extendleft(reversed(document_paths))


def _find_config(file: str) -> Config:
    return find_settings(file).config_for(file, Config())


def _load_subject(file: str) -> CheckTarget:
    """Return the check target of a file, and keep it and its object for later readers."""
    subject = load_subject(file, _find_config(file))
    read_subject.keep(file, subject)
    if not isinstance(subject, Setup) or subject.faults or subject.sure_until is not None:
        return subject
    if subject.top is not None:
        keep_object(file, subject.top, subject.notes)
    return subject
