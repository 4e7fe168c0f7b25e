"""Conversion of objects to text in OpenSim's layout.

One tab per level, properties in the order of the catalogue, and only those that were set.
"""

from __future__ import annotations

from copy import copy
from functools import cache
from pathlib import Path
from typing import Any, Literal

from lxml import etree

from osimlite.base.files import get_relative_path, write_atomically
from osimlite.errors import NotWellFormedError
from osimlite.io.document.lexical import make_formatter, split_words
from osimlite.io.document.parsing import parse_source, read_version
from osimlite.io.document.reader import read_tree
from osimlite.io.document.source import Source
from osimlite.io.document.xml_text import escape_text, format_xml, list_lines, quote_attribute
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.layout import Include, Layout, Remark
from osimlite.schema.model import CURRENT_VERSION, Model, check_is_model
from osimlite.schema.specs import FieldSpec, get_defaults, get_field_specs

Numbers = Literal["shortest", "opensim"]
DECLARATION = '<?xml version="1.0" encoding="UTF-8" ?>'
"""First line of every document."""


def to_text(top: Object, *, numbers: Numbers = "shortest", comments: bool = True) -> str:
    """Return the document of a model, or of another object that has its own documents, such as a setup.

    Args:
        top: object to print. References of a model must lead to components of the model.
        numbers: ``"shortest"`` prints the shortest decimal that reads back equal, ``"opensim"`` 17
            significant digits.
        comments: whether to print the comments of the file that the object was read from.

    Raises:
        ModelError: a reference leads to a component outside the model.
    """
    return _format_document(_Printer(top, numbers, comments))


def write(top: Object, path: str | Path, *, numbers: Numbers = "shortest") -> None:
    """Write the file of a model or of another object; a failure leaves no partial file.

    An object that was included from another file and is unchanged is written as a reference to that
    file.

    Args:
        top: object to write, as for `to_text`.
        path: file to write.
        numbers: format of the numbers, as for `to_text`.

    Raises:
        ModelError: a reference leads to a component outside the model.
        OsimliteError: the file cannot be written.
    """
    write_atomically(
        path, _format_document(_Printer(top, numbers, True, Path(path).resolve().parent))
    )


def _format_document(printer: _Printer) -> str:
    top = printer.top
    layout = top.layout or Layout()
    lines = printer.lines
    lines.append(DECLARATION)
    printer.print_comments(layout.prolog, 0)
    lines.append(f'<OpenSimDocument Version="{CURRENT_VERSION}">')
    printer.print_object(top, top.name, 1)
    lines.append("</OpenSimDocument>")
    printer.print_comments(layout.epilog, 0)
    return "\n".join(lines) + "\n"


class _Printer:
    """Printer of one document; `folder` is where the document will be, if known."""

    def __init__(
        self, top: Object, numbers: str, comments: bool, folder: Path | None = None
    ) -> None:
        if not isinstance(top, Object) or type(top).abstract:
            check_is_model(top)
        self.top = top
        self.tree = top.tree() if isinstance(top, Model) else None
        self.numbers = numbers
        self.comments = comments
        self.folder = folder
        self.lines: list[str] = []
        block = top.layout.defaults if top.layout is not None else []
        self.defaults = {type(item): item for item in reversed(block)}

    def print_object(self, item: Object, name: str, depth: int) -> None:
        """Print one object as an element.

        Args:
            item: object to print.
            name: value of the attribute `name`; "" for no attribute.
            depth: number of tabs before the element.
        """
        indent = "\t" * depth
        layout = item.layout
        if layout is not None:
            self.print_comments(layout.comments, depth)
        if isinstance(item, Unknown):
            self._print_unknown(item, depth)
        elif layout is not None and layout.include is not None and layout.include.content == item:
            self.lines.append(
                f"{indent}<{item.tag} file={quote_attribute(self._get_include_path(layout.include))} />"
            )
        else:
            start_tag = f"{indent}<{item.tag}" + (f" name={quote_attribute(name)}" if name else "")
            if layout is not None:
                start_tag += "".join(
                    f" {key}={quote_attribute(text)}" for key, text in layout.attributes.items()
                )
            self.lines.append(start_tag + ">")
            if item is self.top and layout is not None and layout.defaults:
                self._print_defaults(layout.defaults, depth + 1)
            present = item.model_fields_set
            default = self.defaults.get(type(item))
            # Defaults that were never accessed do not exist yet, and need not be created if they
            # print nothing.
            unprinted = (
                get_defaults(type(item))[1].keys() - item.__dict__.keys() - present
                if default is None
                else set()
            )
            if unprinted:
                unprinted &= _list_unprinted_defaults(type(item))
            for spec in get_field_specs(type(item)).values():
                if layout is not None and layout.before and spec.tag in layout.before:
                    self._print_remarks(layout.before[spec.tag], depth + 1)
                if spec.name in unprinted and (layout is None or spec.name not in layout.inherited):
                    continue
                value = getattr(item, spec.name)
                if (
                    spec.name in present
                    or (default is not None and value != getattr(default, spec.name))
                    or (default is None and layout is not None and spec.name in layout.inherited)
                    or (
                        default is None
                        and isinstance(spec.kind, ObjectField)
                        and has_content(value, spec)
                    )
                    # A default object may have values other than the defaults of its class, such as
                    # the axes of a SpatialTransform. (`x != y == y` is false for NaN.)
                    or (
                        default is None
                        and not isinstance(spec.kind, ObjectField)
                        and value != spec.default == spec.default
                    )
                ):
                    self._print_property(item, spec, value, depth + 1)
            if layout is not None and None in layout.before:
                self._print_remarks(layout.before[None], depth + 1)
            self.lines.append(f"{indent}</{item.tag}>")
        if layout is not None and layout.after:
            self._print_remarks(layout.after, depth)

    def _print_defaults(self, block: list[Object], depth: int) -> None:
        """Print a ``<defaults>`` block; values equal to it are not printed for the objects themselves."""
        defaults, self.defaults = self.defaults, {}
        self.lines.append("\t" * depth + "<defaults>")
        for item in block:
            if self.numbers == "opensim":
                # In this block OpenSim prints all properties of the first system.
                item = copy(item)
                item.model_fields_set.update(
                    spec.name for spec in get_field_specs(type(item)).values() if spec.legacy
                )
            self.print_object(item, item.name, depth + 1)
        self.lines.append("\t" * depth + "</defaults>")
        self.defaults = defaults

    def _print_unknown(self, item: Unknown, depth: int) -> None:
        if item.content:
            self.lines.extend(
                format_xml(item.content, depth, comments=self.comments, name=item.name)
            )
        else:
            name = f" name={quote_attribute(item.name)}" if item.name else ""
            self.lines.append("\t" * depth + f"<{item.class_name}{name} />")

    def _get_include_path(self, include: Include) -> str:
        """Return the path of an included file relative to the folder of the document."""
        if self.folder is None or Path(self.folder, include.file).resolve() == Path(include.path):
            return include.file
        return get_relative_path(include.path, self.folder)

    def _print_property(self, item: Object, spec: FieldSpec, value: Any, depth: int) -> None:
        """Print one property as an element with its value, or with the objects it holds."""
        kind = spec.kind
        indent = "\t" * depth
        if not isinstance(kind, ObjectField):
            if value is None and not (isinstance(kind, Value) and kind.scalar != "string"):
                # An empty element would be read as an empty text.
                return
            text = self._format_value(item, spec, value)
            # OpenSim prints an empty value of the first property system as one tag, and others with
            # an end tag.
            is_short = not text and spec.legacy
            self.lines.append(
                f"{indent}<{spec.tag} />"
                if is_short
                else f"{indent}<{spec.tag}>{text}</{spec.tag}>"
            )
        elif kind.form == "single" and not (
            isinstance(value, Unknown) and value.class_name in get_field_specs(type(item))
        ):
            self.print_object(value, spec.tag, depth)
        elif kind.form == "unnamed":
            self.print_object(value, value.name, depth)
        else:
            members = value if isinstance(value, list) else [] if value is None else [value]
            if not members:
                self.lines.append(f"{indent}<{spec.tag} />")
                return
            self.lines.append(f"{indent}<{spec.tag}>")
            for member in members:
                self.print_object(member, member.name, depth + 1)
            self.lines.append(f"{indent}</{spec.tag}>")

    def _format_value(self, item: Object, spec: FieldSpec, value: Any) -> str:
        if isinstance(spec.kind, Reference):
            value = self._convert_reference(item, spec.kind, value)
        layout: Layout | None = item.layout
        if layout is not None and spec.name in layout.raw:
            read_as, raw = layout.raw[spec.name]
            if read_as is value or read_as == value:
                return escape_text(raw)
        return escape_text(make_formatter(spec.kind, self.numbers)(value))

    def _convert_reference(self, item: Object, reference: Reference, value: Any) -> Any:
        if isinstance(value, Component):
            if self.tree is None:
                return (
                    value.path
                    if reference.rule == "socket" or "path" in reference.rule
                    else value.name
                )
            return self.tree.format_reference(self.tree.owner_of(item), reference, value)
        if isinstance(value, tuple):
            return tuple(self._convert_reference(item, reference, word) for word in value)
        return "" if value is None else value

    def _print_remarks(self, remarks: list[Remark], depth: int) -> None:
        for remark in remarks:
            if remark.element:
                self.lines.extend(format_xml(remark.text, depth, comments=self.comments))
            else:
                self.print_comments([remark.text], depth)

    def print_comments(self, texts: list[str], depth: int) -> None:
        """Print comments, one per line.

        Args:
            texts: comments without ``<!--`` and ``-->``.
            depth: number of tabs before each.
        """
        if self.comments:
            indent = "\t" * depth
            self.lines.extend(f"{indent}<!--{text}-->" for text in texts)


@cache
def _list_unprinted_defaults(cls: type[Object]) -> frozenset[str]:
    """Return the properties of a class whose default objects and lists print nothing."""
    factories = get_defaults(cls)[1]
    object_specs = (
        spec
        for spec in get_field_specs(cls).values()
        if spec.name in factories and isinstance(spec.kind, ObjectField)
    )
    return frozenset(
        spec.name for spec in object_specs if not has_content(factories[spec.name](), spec)
    )


def has_content(value: Any, spec: FieldSpec | None = None) -> bool:
    """Return whether an object or list that was not assigned has content to print.

    Args:
        value: object or list of objects.
        spec: property that holds the value; None if it is unknown.
    """
    if isinstance(value, list):
        return bool(value)
    if not isinstance(value, Object):
        return False
    form = spec.kind.form if spec is not None and isinstance(spec.kind, ObjectField) else ""
    if form == "list" or (form == "optional" and spec is not None and spec.factory is None):
        # A member is content even if nothing in it was set, for example a marker at the origin: it
        # is not there by default.
        return True
    if value.model_fields_set - {"name"} or value.layout is not None:
        return True
    return any(has_content(child, inner_spec) for inner_spec, child in value.list_owned_objects())


def format_document(source: Source) -> str:
    """Return the text of a document in canonical layout.

    A document of the current version is read and printed. A document of another version keeps its
    version and its words: only white space changes, and comments that OpenSim generates are removed.

    Raises:
        DocumentError: the text is not an OpenSim document; with line and column.
    """
    try:
        root = parse_source(source)
    except NotWellFormedError as fault:
        from osimlite.io.document.repair import read_repaired

        root, _ = read_repaired(source, fault, parse_source)
    version = read_version(source, root)
    if version == CURRENT_VERSION:
        return to_text(read_tree(source, root, version, Object).top)
    for element in root.iter(etree.Element):
        if not len(element):
            element.text = " ".join(split_words(element.text or "")) or None
    nodes = [*[*root.itersiblings(preceding=True)][::-1], root, *root.itersiblings()]
    return (
        "\n".join([DECLARATION, *(line for node in nodes for line in list_lines(node, 0))]) + "\n"
    )
