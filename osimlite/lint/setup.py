"""Setups of tools, and the sets of tasks, loads or markers that tools read, as check targets.

Files are searched where OpenSim searches them; a set is checked with the model of the tool that
refers to it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.io.document.cache import get_object
from osimlite.io.document.survey import Survey
from osimlite.lint.config import Config
from osimlite.lint.neighbours import (
    list_documents,
    list_folders,
    read_beginning,
    read_table,
    read_tree,
)
from osimlite.lint.project_files import is_table
from osimlite.lint.registry import Rule
from osimlite.lint.subject import Subject
from osimlite.lint.table import Table
from osimlite.schema.base import Object
from osimlite.schema.fields import Reference
from osimlite.schema.model import Model
from osimlite.schema.specs import (
    FieldSpec,
    get_file_specs,
    get_member_specs,
    get_name_spec,
    get_naming_specs,
)
from osimlite.schema.tree import Tree, Use, is_a

NO_FILE_CONSEQUENCE = "OpenSim rejects this, unless a program or the GUI supplies the file"
"""Consequence for a tool that lacks the name of a required file."""
# Cheap test of the first bytes of a file, which saves parsing documents that cannot be tools.
_NAMES_MODEL = compile_later(rb"Tool|Moco|ModelProcessor")
# Folders of data sets hold thousands of documents; a check must not read them all.
_MAX_NEIGHBOURS = 200
_MODEL_RULES = frozenset(("OSIM110", "OSIM111", "OSIM209"))
"""Codes of rules on tags and values that apply to models only."""


class FileReference(NamedTuple):
    """Reference to a file: the object, its property, the name and the path."""

    item: Object
    spec: FieldSpec
    name: str
    path: str


class Setup(Subject):
    """Document whose top object is not a model. An unreadable document has None as `top`."""

    about: ClassVar[str] = "document"

    def __init__(self, survey: Survey, config: Config | None = None) -> None:
        super().__init__(survey, config)
        self._examined_paths: dict[str, None] = {}
        self._tools_by_folder: dict[Path, list[tuple[str, Object]]] = {}

    def is_for(self, rule: Rule) -> bool:
        """Return whether a rule applies: rules on text, tags and values apply to every document."""
        if rule.code == "OSIM004":
            return True
        if rule.name == "included-file":
            return self.top is not None
        if rule.about == "model":
            # Codes 0xx are about text, 1xx about structure, 2xx about values: these hold for any
            # object.
            return rule.code not in _MODEL_RULES and (
                rule.code[4] == "0" or (rule.code[4] in "12" and self.top is not None)
            )
        return rule.about == self.about and self.top is not None and self.sure_until is None

    @cached_property
    def items(self) -> list[Object]:
        """Objects of the document, in its order."""
        return [] if self.top is None else list(self.top.walk())

    @cached_property
    def by_class(self) -> dict[type[Object], list[Object]]:
        """Return the objects of the document by their exact class.

        Returns:
            Objects of each class in the order of the document.
        """
        result: dict[type[Object], list[Object]] = {}
        for item in self.items:
            result.setdefault(type(item), []).append(item)
        return result

    @cached_property
    def setup_items(self) -> list[Object]:
        """Objects outside of any model in the document, in document order."""
        # A study of Moco may contain its model; rules for setups must not report on that.
        model_parts = {id(part) for model in self.by_class.get(Model, ()) for part in model.walk()}
        return [item for item in self.items if id(item) not in model_parts]

    def find_having(self, *properties: str) -> Iterator[Any]:
        """Yield every object whose class has these properties, class by class."""
        for cls, items in self.by_class.items():
            if all(name in cls.model_fields for name in properties):
                yield from items

    def _find_parent(self, component: Object) -> None:
        """Return None: a part that the class of a setup adds has no element, and no component above it."""

    def owner(self, item: Object) -> Any:
        """Return the object itself: a setup has no tree of components."""
        return item

    def _find_element(self, item: Object | None) -> int | None:
        """Return the element of an object; the top element if the text does not contain the object."""
        # Findings on missing parts of the document are at the top element.
        number = None if item is None else item._index
        return number if number is not None or self.top is None else self.top._index

    def list_outside_paths(self) -> list[str] | None:
        """Return every path on which the check depends."""
        paths = super().list_outside_paths()
        return None if paths is None else [*paths, *self._examined_paths]

    # ------------------------------------------------------------------------------------------------- files

    def find_named_files(self, rule: str) -> Iterator[FileReference]:
        """Yield every file that an object of the document names by a rule."""
        for item in self.setup_items:
            for spec, name in list_files(item, rule):
                yield FileReference(item, spec, name, self.resolve_path(name.strip()))

    def resolve_path(self, name: str) -> str:
        """Return the path of a file as OpenSim finds it when started in the folder of the setup."""
        folder = str(self.folder or Path())
        path = os.path.join(folder, name)
        # Recorded for the cache of reports: the finding changes when a file appears here.
        self._examined_paths[path] = None
        if not os.path.isfile(path):
            self._examined_paths[os.path.dirname(path)] = None
            # A file that is not in that folder is searched in the working folder.
            if os.path.isfile(name) and not os.path.isabs(name):
                return name
        return path

    def read_table(self, name: str) -> Table | None:
        """Return the table in a file of this setup; None if it is missing or unreadable."""
        return (
            read_table(self.resolve_path(name.strip()))
            if names_file(name) and is_table(name)
            else None
        )

    def iterate_with_tables(self, items: Iterable[Any], tag: str) -> Iterator[tuple[Any, Table]]:
        """Yield objects with the table that a property names; objects without a readable table are left out.

        Args:
            items: objects that name tables.
            tag: attribute of the property with the name.
        """
        for item in items:
            table = self.read_table(getattr(item, tag))
            if table is not None and table.labels:
                yield item, table

    def read_document(self, name: str) -> Object | None:
        """Return the top object of a document of this setup; None if it is missing or unreadable."""
        return get_object(self.resolve_path(name.strip())) if names_file(name) else None

    # ------------------------------------------------------------------------------------------------- context

    def iterate_neighbours(self) -> Iterator[tuple[str, Object]]:
        """Yield tools in this folder, its parent, and folders beside and below, with the paths of their setups.

        A folder is read at the first access: most sets belong to a tool in their own folder.
        """
        if self.folder is None:
            return
        folder = self.folder.resolve()
        neighbour_folders = (
            other for above in (folder, folder.parent) for other in list_folders(above)
        )
        yield from self._read_tools(chain((folder, folder.parent), neighbour_folders))

    def list_tools_in_folder(self) -> list[tuple[str, Object]]:
        """Return the tools in the folder of this document, with the paths of their setups."""
        return [] if self.folder is None else self._read_folder(self.folder.resolve())

    def _read_tools(self, folders: Iterable[Path]) -> Iterator[tuple[str, Object]]:
        """Yield the tools in setup files directly in folders, each folder once.

        Args:
            folders: folders to search, without those below them.

        Yields:
            Path of each setup, and its tool.
        """
        visited: set[Path] = set()
        for folder in folders:
            if folder not in visited:
                visited.add(folder)
                yield from self._read_folder(folder)

    def _read_folder(self, folder: Path) -> list[tuple[str, Object]]:
        """Return the tools that name a model in setup files directly in a folder, and note what was read.

        Args:
            folder: path of the folder; its first `_MAX_NEIGHBOURS` documents are read.

        Returns:
            Path of each setup, and its tool.
        """
        if folder in self._tools_by_folder:
            return self._tools_by_folder[folder]
        tools = self._tools_by_folder[folder] = []
        # The cache of reports must expire when a file in the folder appears or changes.
        self._examined_paths[str(folder)] = None
        for file in (list_documents(str(folder)) or [])[:_MAX_NEIGHBOURS]:
            # Most documents are no tools, which their first bytes show without parsing.
            top = get_object(file) if _NAMES_MODEL.search(read_beginning(file)) else None
            if top is not None and _find_model_file(top) is not None:
                tools.append((file, top))
                self._examined_paths[file] = None
        return tools

    @cached_property
    def tool(self) -> tuple[str, Object] | None:
        """Return the tool of this document, or the first one that reads it.

        Returns:
            Path of the tool's setup, and the tool; None without one.
        """
        return next(self.find_readers(), None)

    def find_readers(self) -> Iterator[tuple[str, Object]]:
        """Yield this tool, or all tools that read this document, with the paths of their setups."""
        if self.top is None or self.file is None:
            return
        if _find_model_file(self.top) is not None:
            yield self.file, self.top
            return
        document_path = os.path.realpath(self.file)
        # Paths may differ by symbolic links and by "..".
        for file, top in self.iterate_neighbours():
            folder = os.path.dirname(file)
            if any(
                os.path.realpath(os.path.join(folder, name)) == document_path
                for name in _list_read_files(top)
            ):
                yield file, top

    @cached_property
    def model_file(self) -> str | None:
        """Path of the model of the tool; None without a tool or a model file."""
        return (
            None
            if self.tool is None
            else self._resolve_tool_path(_find_model_file(self.tool[1]) or "")
        )

    @cached_property
    def tree(self) -> Tree | None:  # type: ignore[override]
        """Component tree of the model of the tool; None if no model can be read."""
        if self.model_file is not None:
            return read_tree(self.model_file)
        # A study may hold its model itself.
        models = (
            [item for item in self.tool[1].walk() if isinstance(item, Model) and item._index]
            if self.tool is not None
            else []
        )
        return Tree(models[0]) if models else None

    @cached_property
    def uses(self) -> list[Use]:
        """References to components and other things by name in the document."""
        result: list[Use] = []
        references_by_member: dict[int, Reference | None] = {}
        for item in self.setup_items:
            cls = type(item)
            # Names in a setup are searched in the model: no component of the document owns them.
            owner: Any = item if self.tree is None else self.tree.model
            names = references_by_member.get(id(item))
            if item.name and (names is not None or cls.name_reference is not None):
                result.append(Use(item, owner, get_name_spec(cls, names), item.name))
            for spec in get_member_specs(cls):
                property_value = getattr(item, spec.name)
                members = (
                    property_value
                    if isinstance(property_value, list)
                    else getattr(property_value, "objects", ())
                )
                references_by_member |= dict.fromkeys(map(id, members), spec.names)
            for spec in get_naming_specs(cls):
                if names is not None and spec.reference.rule == names.rule:
                    spec = spec._replace(kind=names)
                value = getattr(item, spec.name)
                if isinstance(value, tuple):
                    result += [
                        Use(item, owner, spec, name, position)
                        for position, name in enumerate(value)
                    ]
                elif value:
                    result.append(Use(item, owner, spec, value))
        return result

    def read_tool_table(self, name: str) -> Table | None:
        """Return a table that the tool names; None if it is missing or unreadable."""
        path = self._resolve_tool_path(name) if is_table(name) else None
        return None if path is None else read_table(path)

    def _resolve_tool_path(self, name: str) -> str | None:
        """Return the path of a file that the tool names; None if it names none."""
        if not names_file(name) or self.tool is None:
            return None
        path = os.path.join(os.path.dirname(self.tool[0]), name.strip())
        self._examined_paths[path] = None
        return path

    def list_names(self, target: str) -> set[str]:
        """Return the names of all components of a class, in the model and in added sets."""
        if self.tree is None or self.tool is None:
            return set()
        # The sets that the tool adds are part of its model when it runs.
        names = {item.name for item in self.tree.find_by_class(target).values()}
        return names | {
            item.name for _, added in self.added_sets for item in added.walk() if is_a(item, target)
        }

    def is_bound(self, name: str) -> bool:
        """Return whether a coordinate of the model is locked, prescribed, or determined by others."""
        assert self.tree is not None
        couplers: Any = self.tree.find_by_class("CoordinateCouplerConstraint").values()
        # OpenSim determines the values of all of these itself, so no tool can drive such a
        # coordinate.
        coordinate = self.tree.find_by_class("Coordinate").get(name)
        is_fixed = any(getattr(coordinate, flag, False) for flag in ("locked", "prescribed"))
        return is_fixed or name in {str(coupler.dependent_coordinate_name) for coupler in couplers}

    @cached_property
    def added_sets(self) -> list[tuple[str, Object]]:
        """The sets of forces and markers that the tool adds to its model, with the paths of their files."""
        if self.tool is None:
            return []
        top = self.tool[1]
        names = [*getattr(top, "force_set_files", ()), getattr(top, "marker_set_file", "")]
        names.append(getattr(getattr(top, "generic_model_maker", None), "marker_set_file", ""))
        files = filter(None, map(self._resolve_tool_path, names))
        return [(file, added) for file in files if (added := get_object(file)) is not None]

    def find_writer(self, path: str) -> str | None:
        """Return another setup of the project that writes a file; None without one."""
        target = os.path.realpath(path)
        around = self._read_tools(list(Path(target).parents)[:3])
        files_by_name_length: dict[int, str] = {}
        for file, top in dict([*self.iterate_neighbours(), *around]).items():
            if self.file is not None and os.path.realpath(file) == os.path.realpath(self.file):
                # Only other setups are searched.
                continue
            folder = os.path.dirname(file)
            results = getattr(top, "results_directory", "") or "."
            results_folder = os.path.realpath(os.path.join(folder, results))
            # Tools that run through time call their tables by their own name, which may begin with
            # that of another.
            has_tool_prefix = os.path.dirname(target) == results_folder and os.path.basename(
                target
            ).startswith(f"{top.name}_")
            if has_tool_prefix and _writes_prefixed_tables(top, target):
                files_by_name_length[len(top.name)] = file
            for item in top.walk():
                for _, name in list_files(item, "output-file"):
                    if target in (
                        os.path.realpath(os.path.join(base, name))
                        for base in (folder, results_folder)
                    ):
                        return file
        # Of several names that fit, the longest is the most specific.
        return files_by_name_length[max(files_by_name_length)] if files_by_name_length else None


def _writes_prefixed_tables(tool: Object, path: str) -> bool:
    """Return whether a tool may write a file whose name begins with the tool's name.

    ScaleTool and InverseDynamicsTool write only files that they name. No tool writes measured
    markers, and models have names of their own.
    """
    if is_a(tool, "ScaleTool") or is_a(tool, "InverseDynamicsTool"):
        return False
    return os.path.splitext(path)[1] in ("", ".sto", ".mot", ".xml")


def names_file(name: str) -> bool:
    """Return whether a text names a file; the word Unassigned stands for none."""
    return name.strip() not in ("", "Unassigned")


def get_content_type(spec: FieldSpec) -> str:
    """Return the content of the file of a property: a class of objects, or a type of table."""
    return spec.reference.target.removesuffix(" file")


def list_files(item: Object, rule: str) -> Iterator[tuple[FieldSpec, str]]:
    """Yield every file that an object names by a rule.

    Args:
        item: object that names files.
        rule: rule of the reference, such as "file".
    """
    for spec in get_file_specs(type(item), rule):
        value = getattr(item, spec.name)
        for name in value if isinstance(value, tuple) else (value,):
            if isinstance(name, str) and names_file(name):
                yield spec, name


def find_motion_file(file: str, tool: Object) -> str:
    """Return the path of the coordinates that a tool reads; empty if it reads none.

    Args:
        file: path of the setup.
        tool: object of the tool.
    """
    name = next(
        (name for spec, name in list_files(tool, "file") if get_content_type(spec) == "motion"), ""
    )
    return name and os.path.realpath(os.path.join(os.path.dirname(file), name.strip()))


def select_members(owner: Any, target: str) -> list[Any]:
    """Return the objects of a set or list that have a class; a text may contain others.

    Args:
        owner: set or list.
        target: name of the class.
    """
    return [
        item for item in (owner if isinstance(owner, list) else owner.objects) if is_a(item, target)
    ]


def _list_read_files(top: Object) -> Iterator[str]:
    """Yield every file that is read with a document, as it is named."""
    for item in top.walk():
        if item.layout is not None and item.layout.include is not None:
            yield item.layout.include.path
        yield from (name for _, name in list_files(item, "file"))


def _find_model_file(top: Object) -> str | None:
    """Return the model file of a tool; None if the object is not a tool."""
    for item in top.walk():
        if "model_file" in vars(item):
            return str(vars(item)["model_file"])
        if is_a(item, "ModelProcessor"):
            return str(getattr(item, "filepath", ""))
    return None
