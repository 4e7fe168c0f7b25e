"""OSIM7xx: further files that a model needs."""

from __future__ import annotations

import os
from functools import lru_cache

from osimlite.base.files import MESH_FOLDER_HINT
from osimlite.base.text import format_count, join_words
from osimlite.io.document.source import Source
from osimlite.lint.registry import ERROR, INFO, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Object
from osimlite.schema.geometry import Mesh
from osimlite.schema.resolution import is_a


@rule("OSIM701", "missing-mesh", severity=WARNING, consequences=(REFUSES,))
def report_missing_mesh(subject: Subject, report: FindingCollector) -> None:
    """A mesh file does not exist.

    Looks for the file of each mesh in the same places as OpenSim: beside the model, in a folder
    `Geometry` next to it, and in the folders of the configuration. If a file differs only in letter
    case, or is found with / instead of a backslash, the rule suggests this file.

    OpenSim draws nothing for such a mesh. If the mesh is a contact mesh, OpenSim rejects the model.
    A name in the wrong case works on Windows and macOS and fails on Linux; a name with a backslash
    works on Windows only.

    ```xml
      <Body name="thigh"> <attached_geometry>
    -     <Mesh name="bone"> <mesh_file>no_such_bone.vtp</mesh_file> </Mesh>
    +     <Cylinder name="bone"> <radius>0.02</radius> <half_height>0.2</half_height> </Cylinder>
      </attached_geometry> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    mesh_files: list[tuple[Object, str, str]] = [
        (mesh, "mesh_file", mesh.mesh_file) for mesh in subject.find_instances(Mesh)
    ]
    mesh_files += [
        (mesh, "filename", mesh.filename) for mesh in subject.find_by_class("ContactMesh")
    ]
    folder = subject.folder if mesh_files else None
    if folder is None:
        return
    # OpenSim's search order.
    search_folders = (
        folder,
        folder / "Geometry",
        *(folder / path for path in subject.config.mesh_paths),
    )
    # The settings may name the model's folder again, by another path.
    unique_paths: dict[str, str] = {}
    for path in search_folders:
        unique_paths.setdefault(os.path.realpath(path), str(path))
    folder_paths = [*unique_paths.values()]
    tried = join_words(folder_paths)
    # A hundred meshes lie in one folder, which is listed once.
    remedy = f"name its folder {MESH_FOLDER_HINT}"
    folders = _FolderListings()
    for item, tag, name in mesh_files:
        severity = ERROR if is_a(item, "ContactMesh") else None
        if not name:
            consequence = "" if severity is None else ": OpenSim rejects the model"
            report(
                f"{describe_object(item)} names no file{consequence}",
                item,
                tag=tag,
                severity=severity,
            )
            continue
        if any(folders.has(folder_path, name) for folder_path in folder_paths):
            continue
        twin = folders.find_other_case(folder_paths, name)
        message = (
            f"the file '{name}' of {describe_object(item)} was not found; searched {tried}; "
            f"{remedy}"
        )
        # `lexists` is true also for broken links.
        if any(os.path.lexists(os.path.join(folder_path, name)) for folder_path in folder_paths):
            message = (
                f"'{name}' of {describe_object(item)} is a folder, a device or a broken link, not "
                "a file"
            )
        if twin is not None:
            message = (
                f"the file '{name}' of {describe_object(item)} is named '{twin}': systems with "
                "case-sensitive file names do not find it"
            )
        # First the same name with slashes, then one in another letter case.
        elif "\\" in name:
            slash_name = name.replace("\\", "/")
            twin = (
                slash_name
                if any(folders.has(folder_path, slash_name) for folder_path in folder_paths)
                else None
            )
            other_case_name = (
                None if twin is not None else folders.find_other_case(folder_paths, slash_name)
            )
            if other_case_name is not None:
                twin = f"{slash_name.rpartition('/')[0]}/{other_case_name}"
            if twin is not None:
                message = (
                    f"the file '{name}' of {describe_object(item)} exists as '{twin}': only "
                    "Windows accepts backslashes, other systems do not find it"
                )
        report(message, item, tag=tag, suggestion=twin, severity=severity)


@rule("OSIM702", "included-file", severity=INFO)
def report_included_file(subject: Subject, report: FindingCollector) -> None:
    """An object is stored in another file.

    Reports objects with the attribute `file`, as an info. The finding is a warning if that file
    does not exist, lacks the object, is not an ordinary file (a pipe, a device), or is larger than
    the setting `largest-file`. The finding is an error if the element itself has content. It is
    also an error if the file cannot be read and another component refers to the object.

    OpenSim reads the object from the other file, and ignores the content of the element. When it
    saves the model, it overwrites the other file, too. If the file is missing, OpenSim continues
    with an empty object.

    ```xml
    - <MarkerSet file="markers.xml" />
    + <MarkerSet>
    +     <objects>
    +         <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    +     </objects>
    + </MarkerSet>
    ```
    """
    for note in subject.notes:
        if note.kind != "include" or note.owner is None or not note.value:
            continue
        included = note.owner.layout is not None and note.owner.layout.include is not None
        # Without a folder the reader could not look for the file, and has no reason.
        is_read = included or (subject.folder is None and not note.why)
        if note.owner is subject.top:
            report(
                f"OpenSim does not read {describe_object(note.owner)} from '{note.value}': it "
                "reads the content given here",
                note.owner,
                number=note.number,
                attribute="file",
                severity=INFO,
            )
            continue
        ignored = _has_content(subject.source, note.number)
        state = "is read from" if is_read else "should be read from"
        reason = (
            ""
            if is_read
            else f", which {note.why or 'OpenSim does not read, because the object is a member of a set'}"
        )
        consequence = (
            ": OpenSim ignores the content given here"
            if ignored
            else ": the object stays empty"
            if note.why
            else ""
        )
        # Objects that stay empty have no name either.
        uses = subject.uses if note.why and subject.model is not None else []
        use_count = sum(subject.resolution(use).target is note.owner for use in uses)
        if use_count:
            consequence += (
                f", while {format_count(use_count, 'reference')} to it "
                f"{'leads' if use_count == 1 else 'lead'} nowhere"
            )
        report(
            f"{describe_object(note.owner)} {state} '{note.value}'{reason}{consequence}",
            note.owner,
            number=note.number,
            attribute="file",
            severity=ERROR if ignored or use_count else None if is_read else WARNING,
        )


def _has_content(source: Source | None, number: int) -> bool:
    """Return whether an element with ``file=`` has content; OpenSim ignores the file of a member of a set."""
    if source is None:
        return False
    # An empty set has empty elements for members and groups.
    if all(
        source.spans[i].tag in ("objects", "groups") and not source.children(i)
        for i in source.children(number)
    ):
        return False
    end = source.spans[number].end
    around = next((i for i in range(number - 1, -1, -1) if source.spans[i].end >= end), 0)
    return source.spans[around].tag != "objects"


@rule("OSIM703", "missing-data-file", severity=ERROR, consequences=(REFUSES, RUNS))
def report_missing_data_file(subject: Subject, report: FindingCollector) -> None:
    """A file with measured loads, with controls or with a table does not exist.

    Looks for the files of external loads, of controllers and of table sources beside the model and
    in the working folder of the program.

    OpenSim rejects the model when it connects the components. The only exception is the file of a
    ControlSetController: OpenSim then continues without controls.

    ```xml
      <CoordinateActuator name="motor"> <coordinate>knee_angle</coordinate> </CoordinateActuator>
      <PrescribedController name="drive">
    -     <socket_actuators>/forceset/motor</socket_actuators> <controls_file>no_such_controls.sto</controls_file>
    +     <socket_actuators>/forceset/motor</socket_actuators>
    +     <FunctionSet name="ControlFunctions"> <objects> <Constant name="motor" /> </objects> </FunctionSet>
      </PrescribedController>
    ```
    """
    tags = {
        "PrescribedController": "controls_file",
        "ControlSetController": "controls_file",
        "ExternalLoads": "datafile",
        "TableSource": "filename",
    }
    data_files = [
        (item, cls, tag) for cls, tag in tags.items() for item in subject.find_by_class(cls)
    ]
    if not data_files or subject.folder is None:
        return
    folder_paths = [str(subject.folder), ""]
    folders = _FolderListings()
    for item, cls, tag in data_files:
        name = getattr(item, tag)
        # "Unassigned" stands for none, except where OpenSim reads the file without a test.
        if name is None or (cls != "PrescribedController" and name.lower() in ("", "unassigned")):
            continue
        if name and any(folders.has(folder_path, name) for folder_path in folder_paths):
            continue
        twin = folders.find_other_case(folder_paths, name)
        description, consequence = (
            ("it has no controls", RUNS)
            if cls == "ControlSetController"
            else ("OpenSim rejects the model", REFUSES)
        )
        report(
            f"the file '{name}' of {describe_object(item)} does not exist: {description}",
            item,
            consequence=consequence,
            tag=tag,
            suggestion=twin,
        )


class _FolderListings:
    """Listings of the folders in which files are searched, each read once for all meshes."""

    def __init__(self) -> None:
        self._cached_names: dict[str, dict[str, str]] = {}

    def has(self, root: str, name: str) -> bool:
        """Return whether the folder `root` has a file `name`, which may contain folders."""
        listing, file_name = self._list_names(root, name)
        # Of ASCII names the listing decides; it saves a call to the system for each mesh.
        if file_name.isascii() and file_name.lower() not in listing:
            return False
        # The file system may ignore letter case for other characters, and the name may be that of
        # a folder, so ask it.
        return os.path.isfile(os.path.join(root, name))

    def find_other_case(self, roots: list[str], name: str) -> str | None:
        """Return the first file that differs from `name` in letter case only; None without one."""
        for root in roots:
            listing, file_name = self._list_names(root, name)
            twin = listing.get(file_name.lower(), file_name)
            if twin != file_name and os.path.isfile(
                os.path.join(root, os.path.dirname(name), twin)
            ):
                return twin
        return None

    def _list_names(self, root: str, name: str) -> tuple[dict[str, str], str]:
        """Return the names in the folder of a file by their lower case, and the name of the file."""
        folder = root or "."
        file_name = name
        if "/" in name or os.sep in name:
            parent, file_name = os.path.split(name)
            folder = os.path.join(root, parent)
        names = self._cached_names.get(folder)
        if names is None:
            names = self._cached_names[folder] = _list_lower_case(folder)
        return names, file_name


def _list_lower_case(folder: str) -> dict[str, str]:
    try:
        # The listing of a folder holds until something in it is made, renamed or removed.
        # The time of modification is a part of the key, so that a new file is seen.
        return _list_folder(folder, os.stat(folder).st_mtime_ns)
    except (OSError, ValueError):
        return {}


@lru_cache(maxsize=64)
def _list_folder(folder: str, changed: int) -> dict[str, str]:
    return {name.lower(): name for name in os.listdir(folder)}
