"""Work of ``osimlite convert``: choice of formats, conversion, and report on it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.base.files import make_folder, read_file
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_json, join_words, suggest_name
from osimlite.base.writing import write_into
from osimlite.cli import _options as options
from osimlite.cli._console import add_row, create_table, print_table, say
from osimlite.cli._fidelity_table import tabulate
from osimlite.errors import SettingError
from osimlite.lint.project_files import is_table
from osimlite.translate.exporters import EXPORTERS, Exporter
from osimlite.translate.importers import MARKERS, OSIM, PROJECT, find_format, list_importers

if TYPE_CHECKING:
    from osimlite.schema.model import Model
    from osimlite.translate.fidelity import Fidelity

FIDELITY_FILE = "fidelity.json"
"""File of the record of what was translated, approximated and left out."""

SUMMARY_FILE = "summary.json"
"""File of the facts about a conversion."""


@dataclass(frozen=True)
class Conversion:
    """Result of a conversion.

    Attributes:
        files: written files, the main one first.
        fidelity: record of what was translated, approximated and left out.
        summary: facts about the conversion, as plain data.
        start_note: advice where simulations must start, or "".
    """

    files: list[Path]
    fidelity: Fidelity
    summary: dict[str, object] = field(default_factory=dict)
    start_note: str = ""


@dataclass(frozen=True)
class Request:
    """Conversion that the user asks for.

    Attributes:
        file: file to convert.
        source: name of the format of the file.
        target: name of the format to write.
        folder: folder to write into.
        name: name of the main file without suffix.
    """

    file: Path
    source: str
    target: str
    folder: Path
    name: str

    @classmethod
    def create(
        cls, file: Path, output: Path | None, source: str | None, target: str | None
    ) -> Request:
        """Return the request for a conversion, with its formats and its output folder.

        Args:
            file: file to convert.
            output: file or folder to write; None for a folder named after the file.
            source: name of the format of the file; None to find it.
            target: name of the format to write; None to find it.

        Raises:
            SettingError: a format is unknown, or not determined by the names.
            MissingFileError: the file does not exist.
        """
        # 1. The formats on both sides: named by an option, or known by the file.
        importers = list_importers()
        sources = {OSIM, *importers}
        if source is not None and source not in sources:
            raise SettingError(f"--from: unknown format '{source}'{suggest_name(source, sources)}")
        source_format = find_format(file) if source is None else source
        if source_format is None and is_table(str(file)):
            raise SettingError(
                f"'{file.name}' is a table of OpenSim, and 'convert' does not convert tables "
                "alone; to convert the table together with its model, name the model first and "
                "add --motion"
            )
        written_only = {
            exporter.suffix: exporter
            for exporter in EXPORTERS
            if exporter.suffix and exporter.name not in sources
        }
        if source_format is None and file.suffix in written_only:
            exporter = written_only[file.suffix]
            raise SettingError(
                f"osimlite writes {exporter.title or exporter.name.upper()} files, but does not read them"
            )
        if source_format is None:
            raise SettingError(
                f"'convert' does not recognize the format of '{file.name}'; name the format with --from: "
                f"{', '.join(sorted(sources))}"
            )
        targets = {OSIM, MARKERS, PROJECT, *(exporter.name for exporter in EXPORTERS)}
        if target is not None and target not in targets:
            raise SettingError(f"--to: unknown format '{target}'{suggest_name(target, targets)}")
        by_suffix = None if output is None else _find_target(output, source_format)
        default = importers[source_format].target if source_format in importers else None
        target_format = target or by_suffix or default
        # An existing folder may have a name that looks like a file with a suffix.
        if None not in (target, by_suffix) and target != by_suffix and not _is_folder(output):
            raise SettingError(
                f"-o names a file of the format '{by_suffix}', but --to is '{target}'; leave out one of them"
            )
        if output is not None and _names_other_file(output, by_suffix, target_format):
            advice = (
                "name another file with -o, such as robot.urdf, or a format with --to; --formats lists the formats"
                if target_format is None
                else f"name a file with the suffix '{_get_suffix(target_format)}', or a folder without a suffix"
                if _get_suffix(target_format)
                else "name a folder without a suffix"
            )
            raise SettingError(f"'convert' cannot write '{output.suffix}' files; {advice}")
        if target_format is None:
            raise SettingError(
                "the format to write is unknown; name a file with -o, such as robot.urdf, or a format with --to"
            )
        # Only importers of models lead to other formats than their own.
        no_models = {MARKERS, PROJECT}
        if {target_format, default} & no_models and target_format != default:
            only_target = f", only as '{default}'" if default in no_models else ""
            raise SettingError(
                f"a file of the format '{source_format}' cannot be written as '{target_format}'{only_target}"
            )
        # 3. Where to write.
        if target_format == source_format:
            raise SettingError(
                f"'{file.name}' already has the format '{target_format}'; to bring a model to the current version, use "
                "'osimlite upgrade'"
            )
        # A suffix that belongs to the format makes `-o` the name of the file, else it is a folder.
        is_file = output is not None and output.suffix.lower() == _get_suffix(target_format) != ""
        folder = output.parent if output is not None and is_file else output
        name = output.stem if output is not None and is_file else file.stem
        folder = options.choose_output_folder(file, folder)
        main_path = folder / f"{name}{_get_suffix(target_format)}"
        # `samefile` sees through links and letter case, which text comparisons do not.
        if main_path.exists() and file.exists() and main_path.samefile(file):
            raise SettingError(
                f"'{file}' would be replaced by its conversion; name another file with -o"
            )
        return cls(file, source_format, target_format, folder, name)

    @property
    def main(self) -> str:
        """Name of the main file; "" if the conversion writes a folder."""
        if self.target in (OSIM, MARKERS):
            return f"{self.name}.{self.target}"
        suffix = next(
            (exporter.suffix for exporter in EXPORTERS if exporter.name == self.target), ""
        )
        return f"{self.name}{suffix}" if suffix else ""

    def carry_out(
        self,
        motion: Path | None,
        geometry: Sequence[Path] | None,
        option_values: Mapping[str, Any],
        *,
        overwrite: bool = False,
    ) -> Conversion:
        """Convert the file, and write all results.

        Args:
            motion: file of coordinates over time; None without a motion.
            geometry: folders in which mesh files are searched.
            option_values: options of the formats that were set.
            overwrite: whether files of other conversions and programs may be replaced.

        Returns:
            Written files, record of what was translated, and summary.

        Raises:
            SettingError: an option does not belong to the formats, or a file would be replaced that
                this conversion has not written before.
            OsimliteError: the file cannot be read, or the results cannot be written.
        """
        # Checked before anything is written.
        guard = OutputGuard(self.folder, self.main, self.file.name, overwrite=overwrite)
        guard.protect_records()
        importer = list_importers().get(self.source)
        exporter = next(
            (converter for converter in EXPORTERS if converter.name == self.target), None
        )
        converters = [converter for converter in (importer, exporter) if converter is not None]
        known_names = {option.name for converter in converters for option in converter.choices}
        # All options of all formats are on the command line; only those of these two formats may be
        # given.
        for name in option_values:
            if name not in known_names:
                option = f"--{name.replace('_', '-')}"
                raise SettingError(
                    f"{option} is not an option of a conversion from '{self.source}' to '{self.target}'; "
                    f"leave out {option}"
                )
        if motion is not None and (exporter is None or not exporter.takes_motion):
            raise SettingError(
                f"the format '{self.target}' cannot contain a motion; leave out --motion"
            )
        values = {
            converter.name: {
                option.name: option_values[option.name]
                for option in converter.choices
                if option.name in option_values
            }
            for converter in converters
        }
        # OpenSim's own files are read by the reader of documents, not by an importer.
        if importer is None:
            assert exporter is not None
            from osimlite.io.document.reader import read

            result = self._export(
                read(self.file), exporter, motion, geometry, values[exporter.name], guard
            )
        else:
            imported = importer.read(self.file, name=self.name, **values[importer.name])
            if exporter is None:
                guard.protect_files(imported)
                files = imported.write(self.folder)
                result = Conversion(files, imported.fidelity, dict(imported.summary))
            else:
                # Only importers that make one model can be followed by an exporter, and these have it.
                model: Model = getattr(imported, "model")  # noqa: B009
                result = self._export(
                    model, exporter, motion, geometry, values[exporter.name], guard
                )
                # Losses of the first step are losses of the result, too.
                result.fidelity.records[:0] = imported.fidelity.records
                result.summary.update(imported.summary)
        # Both files are written last, since they describe the others.
        exact_count, changed_count, dropped_count = result.fidelity.counts()
        summary = {
            "source": self.file.name,
            "from": self.source,
            "to": self.target,
            "files": [_get_relative(path, self.folder) for path in result.files],
            "parts": {
                "exact": exact_count,
                "approximated": changed_count,
                "left_out": dropped_count,
            },
            **result.summary,
        }
        fidelity = write_into(self.folder, FIDELITY_FILE, result.fidelity.to_json())
        summary_path = write_into(self.folder, SUMMARY_FILE, format_json(summary))
        # Some exporters write their own record, which the complete one replaces.
        files = [
            *(path for path in result.files if path.name != FIDELITY_FILE),
            fidelity,
            summary_path,
        ]
        return Conversion(files, result.fidelity, summary, result.start_note)

    def _export(
        self,
        model: Model,
        exporter: Exporter,
        motion: Path | None,
        geometry: Sequence[Path] | None,
        option_values: Mapping[str, Any],
        guard: OutputGuard,
    ) -> Conversion:
        """Write a model with an exporter.

        There are two kinds of exporters. Those of model formats, such as URDF, translate the model
        and make their own record. Those of the command `view`, such as glTF, write the scene that the
        viewer shows; their record is made here.

        Args:
            model: model to write.
            exporter: exporter of the target format.
            motion: file of coordinates over time; None without a motion.
            geometry: folders in which mesh files are searched.
            option_values: options of the exporter that were set.
            guard: guard of the output folder; it is asked before anything is written.

        Returns:
            Written files, and the record of what was translated.

        Raises:
            SettingError: a file would be replaced that this conversion has not written before.
            OsimliteError: the model cannot be translated, or the results cannot be written.
        """
        folders = options.list_mesh_folders(self.file, geometry)
        if exporter.command != "view":
            motion_argument = {"motion": motion} if exporter.takes_motion else {}
            exported = exporter.write(
                model,
                folder=self.file.parent,
                name=self.name,
                geometry=folders,
                **motion_argument,
                **option_values,
            )
            guard.protect_files(exported)
            files = exported.write(self.folder)
            # Some formats cannot express the initial state.
            start_note = getattr(exported, "start_note", "")
            return Conversion(files, exported.fidelity, start_note=start_note)
        return self._export_scene(model, exporter, motion, folders, option_values, guard)

    def _export_scene(
        self,
        model: Model,
        exporter: Exporter,
        motion: Path | None,
        mesh_folders: list[Path],
        option_values: Mapping[str, Any],
        guard: OutputGuard,
    ) -> Conversion:
        """Write the scene that the viewer shows of a model, with a record of its parts.

        Args:
            model: model to show; parts that cannot be shown are left out and recorded.
            exporter: exporter of the command `view`.
            motion: file of coordinates over time; None without a motion.
            mesh_folders: folders in which mesh files are searched.
            option_values: options of the exporter that were set.
            guard: guard of the output folder.

        Returns:
            Written file, and the record of the parts that were shown or left out.
        """
        # A scene is one file: no other file of the folder may be replaced.
        guard.protect_files(None)
        from osimlite.schema.forces import Force
        from osimlite.schema.frames import Body
        from osimlite.translate.fidelity import LEFT_OUT, Fidelity
        from osimlite.view.incomplete import MISSING_MESH, build_showable
        from osimlite.view.model_view import ModelView
        from osimlite.view.recording import Recording

        model, mechanism, left_out = build_showable(model)
        model_view = ModelView.from_model(
            model, mechanism, mesh_folders, file=self.file, motion=motion, left_out=left_out
        )
        fidelity = Fidelity(mechanism.name, exporter.name)
        # Bodies become nodes of the scene; forces are no part of it.
        for body in model.components(Body):
            fidelity.translated[body.path] = "node"
        for force in model.components(Force):
            fidelity.add(
                "force",
                force.path,
                "a force or muscle",
                f"{LEFT_OUT}; its path is drawn if it has one",
            )
        for part_path, reason in model_view.scene.remarks:
            if reason.startswith(MISSING_MESH):
                # The table counts parts of one kind: the name of the file is a detail.
                _, _, next_step = reason.partition("; ")
                kind, done = "a mesh whose file was not found", f"{LEFT_OUT}; {next_step}"
            else:
                kind, done = reason, LEFT_OUT
            fidelity.add("view", part_path, kind, done, reason)
        if isinstance(model_view.motion, Recording):
            for remark in model_view.motion.remarks:
                fidelity.add("view", "/", remark, LEFT_OUT)
        path = make_folder(self.folder) / f"{self.name}{exporter.suffix}"
        defaults = {option.name: option.default for option in exporter.choices}
        exporter.write(model_view, path, **{**defaults, **option_values})
        return Conversion([path], fidelity)


def _names_other_file(output: Path, by_suffix: str | None, goal: str | None) -> bool:
    """Return whether an output has the suffix of a file that is not written.

    Folders have suffixes as well; one that begins with a digit, as in 'results-1.2', means a folder.
    """
    suffix = output.suffix.lower()
    if not suffix or by_suffix is not None or _is_folder(output):
        return False
    return not suffix[1:2].isdigit() and (goal is None or suffix != _get_suffix(goal))


def _is_folder(output: Path | None) -> bool:
    """Return whether an output is a folder that exists."""
    return output is not None and output.is_dir()


class OutputGuard:
    """Protection of the files in an output folder against a conversion.

    A conversion replaces the files that it has written before, so that it can be repeated. Other
    files are replaced only on request. One folder has the record of one conversion.

    Args:
        folder: output folder of the conversion.
        main: name of the main file; "" if the conversion writes a folder.
        source: name of the converted file.
        overwrite: whether to replace any file.
    """

    def __init__(self, folder: Path, main: str, source: str, *, overwrite: bool) -> None:
        self.folder, self.main, self.overwrite = folder, main, overwrite
        summary = self._read_summary()
        has_record = (folder / FIDELITY_FILE).is_file()
        if summary:
            files = summary["files"] or [""]
            # A folder of results has no main file by which it could be recognized.
            self.is_repeated = files[0] == main if main else summary["source"] == source
        else:
            # 'osimlite translate' writes no summary.
            self.is_repeated = bool(main) and has_record and (folder / main).is_file()
        self._summary = summary

    def _read_summary(self) -> dict[str, Any] | None:
        """Return the summary of an earlier conversion; None without one."""
        path = self.folder / SUMMARY_FILE
        if not path.is_file():
            return None
        try:
            summary = json.loads(read_file(path))
        except ValueError:
            return None
        is_conversion = (
            isinstance(summary, dict)
            and {
                "source",
                "from",
                "to",
                "files",
                "parts",
            }
            <= summary.keys()
        )
        return summary if is_conversion else None

    def protect_records(self) -> None:
        """Raise SettingError if the record of another conversion or command would be replaced."""
        if self.overwrite:
            return
        if self._summary is None and (self.folder / SUMMARY_FILE).is_file():
            self._refuse(SUMMARY_FILE, "was written by another command")
        if not self.is_repeated and (self.folder / FIDELITY_FILE).is_file():
            self._refuse(FIDELITY_FILE, "is the record of another conversion")

    def protect_files(self, conversion: Any) -> None:
        """Raise SettingError if a file would be replaced that no conversion of this name wrote.

        Args:
            conversion: result with the names of further files as keys of its attribute `files`; None
                without further files.
        """
        if self.overwrite or self.is_repeated:
            return
        # URDF and bioMod have this file beside them.
        sidecar = f"{Path(self.main).stem}.coordinates.json"
        main_files = [self.main, sidecar] if self.main else []
        for name in [*main_files, *getattr(conversion, "files", ())]:
            if (self.folder / name).is_file():
                self._refuse(name, "exists already")

    def _refuse(self, name: str, reason: str) -> None:
        raise SettingError(
            f"'{self.folder / name}' {reason}, and would be replaced; name another folder with -o, or "
            "add --overwrite"
        )


def _find_target(output: Path, source: str) -> str | None:
    """Return the name of the format that the suffix of an output file means; None for a folder."""
    suffix = output.suffix.lower()
    if suffix in (".osim", ".trc"):
        return suffix[1:]
    for exporter in EXPORTERS:
        if exporter.suffix and suffix == exporter.suffix.lower() and exporter.name != source:
            return exporter.name
    return None


def _get_suffix(target: str) -> str:
    """Return the suffix of the main file of a format, in lower case; "" for a folder."""
    if target in (OSIM, MARKERS):
        return f".{target}"
    return next((exporter.suffix.lower() for exporter in EXPORTERS if exporter.name == target), "")


def _get_relative(path: Path, folder: Path) -> str:
    """Return a path relative to a folder, or its name if it is elsewhere."""
    # A name is better than an absolute path, which would differ between machines.
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name


def report(request: Request, result: Conversion) -> None:
    """Print the losses of a conversion and the written files."""
    if len(result.fidelity):
        print_table(tabulate(result.fidelity, request.target))
    exact_count, changed_count, dropped_count = result.fidelity.counts()
    say(
        f"components: {exact_count} exact, {changed_count} approximated or converted, {dropped_count} left out"
    )
    say("wrote " + join_words([str(path) for path in result.files], max_count=4))
    if result.start_note:
        say(result.start_note)


def print_formats() -> None:
    """Print all formats, with suffix, direction and contents."""
    table = create_table()
    for heading in ("format", "suffix", "", "carries"):
        table.add_column(heading, overflow="fold")
    add_row(
        table,
        OSIM,
        ".osim",
        "in, out",
        "everything that a file of OpenSim 4.6 contains; older files are upgraded first",
    )
    exporters = {exporter.name: exporter for exporter in EXPORTERS}
    importers = list_importers()
    for name, importer in importers.items():
        direction = "in, out" if name in exporters else "in"
        # Its result is not a single file.
        result_note = (
            "; writes a folder with models, trials and setups" if importer.target == PROJECT else ""
        )
        add_row(
            table,
            name,
            " ".join(importer.suffixes),
            direction,
            f"{importer.title}: {importer.carries}{result_note}",
        )
    for name, exporter in exporters.items():
        if name not in importers:
            title = exporter.title or name.upper()
            add_row(table, name, exporter.suffix, "out", f"{title}: {exporter.carries}")
    print_table(table)
