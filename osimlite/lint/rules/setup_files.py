"""OSIM82x: the files that a setup names."""

from __future__ import annotations

import os

from osimlite.base.text import add_article, find_nearest
from osimlite.lint.project_files import is_table
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingCollector, rule
from osimlite.lint.setup import (
    NO_FILE_CONSEQUENCE,
    FileReference,
    Setup,
    find_motion_file,
    get_content_type,
    names_file,
)
from osimlite.lint.words import describe_object
from osimlite.schema.specs import get_file_specs
from osimlite.schema.tree import is_a

_TABLE = (".sto", ".mot", ".trc", ".csv")
_ENDINGS = {"table": _TABLE, "motion": _TABLE, "marker data": (".trc", ".sto", ".c3d")}
"""Suffixes of files by their content; other files are documents."""
_SHARED = {
    "external_loads_file": "applies the loads of {}",
    "lowpass_cutoff_frequency_for_coordinates": "filters at {:g} Hz",
    "lowpass_cutoff_frequency": "filters at {:g} Hz",
}
"""Settings that should be equal in all tools that use the same motion."""


@rule("OSIM821", "missing-input", severity=ERROR, fixes="safe", about="document")
def report_missing_input(setup: Setup, report: FindingCollector) -> None:
    """A file that a setup reads is missing or not named.

    Checks whether OpenSim finds every file that a setup reads. File names are relative to the
    folder of the setup, as in OpenSim if it is started there. Files that another setup of the
    project writes need not exist yet. Reports names in the wrong letter case and names with
    backslashes, which only Windows accepts, and suggests a file with a similar name.

    OpenSim rejects the setup. If the model is missing, inverse kinematics crashes. If a file of
    controls is missing, OpenSim only logs this, and the tool runs without controls. A setup that
    names no file is a warning, because a program may supply the file.

    ```setup
      <InverseDynamicsTool name="id">
    -     <model_file>no_such_model.osim</model_file>
    -     <coordinates_file></coordinates_file>
    +     <model_file>leg.osim</model_file>
    +     <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    for naming in setup.find_named_files("file"):
        # A file that another setup of the project writes may come into being later.
        if os.path.isfile(naming.path) or setup.find_writer(naming.path):
            continue
        # Backslashes work on Windows, where OpenSim is mostly used.
        slashed = naming.name.replace("\\", "/")
        has_slash_twin = slashed != naming.name and os.path.isfile(setup.resolve_path(slashed))
        twin = slashed if has_slash_twin else _find_other_case(naming)
        hint = "; backslashes separate folders on Windows only" if "\\" in naming.name else ""
        if not hint and twin is None and (nearest := _find_nearest_file(naming)):
            hint = f", but '{nearest}' does"
        is_optional = is_a(naming.item, "ControlSetController")
        consequence = "OpenSim continues without it" if is_optional else "OpenSim rejects the setup"
        report(
            f"the file '{naming.name}' of {describe_object(naming.item)} does not exist{hint}: "
            f"{consequence}",
            naming.item,
            tag=naming.spec.tag,
            # This property lists several files; the word is marked.
            word=naming.name if naming.spec.tag == "force_set_files" else None,
            suggestion=twin,
            certain=True,
        )
    for maker in setup.find_having("marker_set_file"):
        # An empty name differs from a missing one, which OpenSim takes for none.
        if "marker_set_file" in maker.model_fields_set and not maker.marker_set_file.strip():
            report(
                f"marker_set_file of {describe_object(maker)} is empty: OpenSim rejects the "
                "setup; leave it out, or write Unassigned",
                maker,
                tag="marker_set_file",
                suggestion="Unassigned",
            )
    for item in setup.items:
        for spec in get_file_specs(type(item), "file"):
            if spec.reference.required and not names_file(getattr(item, spec.name)):
                report(
                    f"{describe_object(item)} names no {spec.tag}: {NO_FILE_CONSEQUENCE}",
                    item,
                    tag=spec.tag,
                    severity=WARNING,
                )
        if (
            is_a(item, "MocoPhase")
            # A phase in a study needs its own model.
            and item is not setup.top
            and not (item.model.filepath or getattr(item.model.model, "_index", None))
        ):
            report(
                f"{describe_object(item)} has no model: {NO_FILE_CONSEQUENCE}",
                item,
                severity=WARNING,
            )
        if is_a(item, "AnalyzeTool"):
            named_files = [
                tag for tag in ("states_file", "coordinates_file") if names_file(getattr(item, tag))
            ]
            if len(named_files) != 1:
                file_names = (
                    "both a states_file and a coordinates_file"
                    if named_files
                    else "neither states nor coordinates"
                )
                severity = ERROR if named_files else WARNING
                consequence = "OpenSim rejects it" if named_files else NO_FILE_CONSEQUENCE
                report(
                    f"{describe_object(item)} names {file_names}: {consequence}",
                    item,
                    tag="coordinates_file",
                    severity=severity,
                )


def _find_other_case(naming: FileReference) -> str | None:
    """Return the name of a file that differs in letter case only; None without one."""
    folder, last = os.path.split(naming.path)
    # Windows and macOS find files whatever the letter case, Linux does not.
    try:
        twin = next(
            (
                name
                for name in os.listdir(folder or ".")
                if name.lower() == last.lower() and name != last
            ),
            None,
        )
    except OSError:
        return None
    return None if twin is None else naming.name[: len(naming.name) - len(last)] + twin


def _find_nearest_file(naming: FileReference) -> str | None:
    """Return the most similar name of a file of the same type in the same folder; None without one."""
    folder, last = os.path.split(naming.path)
    suffix = os.path.splitext(last)[1].lower()
    try:
        names = [
            name
            for name in os.listdir(folder or ".")
            if name.lower().endswith(suffix) and name != last
        ]
    except OSError:
        return None
    # Without a suffix, any file would do.
    nearest = find_nearest(last, sorted(names), cutoff=_MIN_FILE_SIMILARITY) if suffix else None
    return None if nearest is None else naming.name[: len(naming.name) - len(last)] + nearest


_MIN_FILE_SIMILARITY = 75.0
"""Least similarity (%) of a file that a message names instead of a missing one: one or two letters differ."""


@rule("OSIM822", "input-of-another-kind", severity=ERROR, about="document")
def report_input_of_another_kind(setup: Setup, report: FindingCollector) -> None:
    """A file that a setup reads has the wrong content.

    Checks whether each file has the content that its property expects. A table is recognised by its
    suffix, a document by the class at its top. For example, a ForceSet is not ExternalLoads.

    OpenSim rejects the file.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
    -     <coordinates_file>leg.osim</coordinates_file>
    +     <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    for naming in setup.find_named_files("file"):
        if not os.path.isfile(naming.path):
            continue
        expected_type, _, either = get_content_type(naming.spec).partition(" or ")
        if either == "table" and is_table(naming.name):
            continue
        if expected_type in _ENDINGS:
            if not naming.name.lower().endswith(_ENDINGS[expected_type]):
                report(
                    f"{naming.spec.tag} of {describe_object(naming.item)} must be a table "
                    f"({', '.join(_ENDINGS[expected_type])})",
                    naming.item,
                    tag=naming.spec.tag,
                )
        elif expected_type[:1].isupper():
            document = None if is_table(naming.name) else setup.read_document(naming.name)
            actual_type = "a table" if document is None else add_article(type(document).__name__)
            if is_table(naming.name) or (
                document is not None and not is_a(document, expected_type)
            ):
                report(
                    f"{naming.spec.tag} of {describe_object(naming.item)}: expected the class {expected_type}, "
                    f"but '{naming.name}' contains {actual_type}",
                    naming.item,
                    tag=naming.spec.tag,
                )


@rule("OSIM823", "lost-output", severity=WARNING, fixes="both", about="document")
def report_lost_output(setup: Setup, report: FindingCollector) -> None:
    """Results would be lost or written elsewhere.

    Checks for a results folder that OpenSim cannot create (it creates only the last folder of a
    path). Also checks for output files in missing folders, and for output files without a name.

    The tool runs to its end, and its results are lost. OpenSim logs a line at most.

    ```setup
      <InverseDynamicsTool name="id">
    -     <results_directory>no_such/folder</results_directory>
    +     <results_directory>results</results_directory>
          <model_file>leg.osim</model_file>
          <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    if setup.folder is None:
        return
    for naming in setup.find_named_files("output-folder"):
        # OpenSim creates one folder, not its parents.
        above = os.path.dirname(os.path.abspath(os.path.join(setup.folder, naming.name)))
        if not os.path.isdir(above):
            report(
                f"OpenSim creates only the last folder of '{naming.name}': the results are lost",
                naming.item,
                tag=naming.spec.tag,
            )
        elif os.path.isabs(naming.name) and not os.path.isdir(naming.name):
            report(
                f"'{naming.name}' does not exist: if OpenSim cannot create it, the results are "
                "lost",
                naming.item,
                tag=naming.spec.tag,
                severity=INFO,
            )
    # A tool creates its results_directory before it writes other files, which may be in it.
    created_folders = {
        os.path.normpath(naming.name) for naming in setup.find_named_files("output-folder")
    }
    for naming in setup.find_named_files("output-file"):
        folder = os.path.dirname(naming.name)
        if is_a(naming.item, "InverseDynamicsTool"):
            if folder:
                report(
                    f"OpenSim ignores the folder of '{naming.name}' and writes to "
                    "results_directory",
                    naming.item,
                    tag=naming.spec.tag,
                    suggestion=os.path.basename(naming.name),
                    certain=True,
                )
        elif (
            folder
            and not os.path.isdir(os.path.join(setup.folder, folder))
            and os.path.normpath(folder) not in created_folders
        ):
            report(
                f"the folder of '{naming.name}' does not exist: OpenSim does not create it",
                naming.item,
                tag=naming.spec.tag,
            )
    for tool in setup.find_by_class("InverseKinematicsTool"):
        folder = os.path.normpath(tool.results_directory or ".")
        name = tool.output_motion_file
        # Only in inverse kinematics; other tools write into the folder for results.
        if folder != "." and name and not os.path.dirname(name):
            report(
                f"'{name}' is written beside the setup: results_directory does not apply to it",
                tool,
                tag="output_motion_file",
                severity=INFO,
                suggestion=f"{folder}/{name}",
            )
    for item in setup.items:
        for spec in get_file_specs(type(item), "output-file"):
            if spec.reference.required and not getattr(item, spec.name).strip():
                report(
                    f"{describe_object(item)} names no {spec.tag}: its results get no proper file "
                    "name",
                    item,
                    tag=spec.tag,
                )


@rule("OSIM824", "tools-differ", severity=INFO, about="document")
def report_tools_differ(setup: Setup, report: FindingCollector) -> None:
    """A tool ignores loads or a filter that another tool applies to the same motion.

    Compares a tool with all other tools in its folder that read the same file of coordinates.
    Reports a difference if only one of them applies measured loads, or if only one of them filters
    the motion.

    Joint moments without ground reactions, or muscle forces from an unfiltered motion, look like
    valid results, but do not match those of the other tool.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
          <time_range>0 0.5</time_range>
    +     <external_loads_file>leg_grf.xml</external_loads_file>
          <coordinates_file>motion.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    if (
        # A set that is read by a tool has no motion itself.
        setup.tool is None
        or setup.tool[1] is not setup.top
        or not (mine := find_motion_file(*setup.tool))
    ):
        return
    tool_path = os.path.realpath(setup.tool[0])
    reported_tags: set[str] = set()
    for file, other_tool in setup.list_tools_in_folder():
        other_path = os.path.realpath(file)
        if (
            other_path == tool_path
            # A symbolic link may lead to a setup in another folder.
            or os.path.dirname(other_path) != os.path.dirname(tool_path)
            or find_motion_file(file, other_tool) != mine
        ):
            continue
        for tag, difference in _SHARED.items():
            value, other_value = (getattr(tool, tag, None) for tool in (setup.top, other_tool))
            if (
                value is not None
                and other_value is not None
                and _is_set(other_value)
                and not _is_set(value)
                # Each setting is reported once, however many tools differ.
                and tag not in reported_tags
            ):
                reported_tags.add(tag)
                report(
                    f"'{os.path.basename(file)}' {difference.format(other_value)} for the same motion, but this "
                    "tool does not",
                    setup.top,
                    tag=tag,
                )


def _is_set(value: str | float) -> bool:
    """Return whether a setting has a value."""
    return names_file(value) if isinstance(value, str) else value > 0.0
