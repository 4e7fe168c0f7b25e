"""Model to text, in OpenSim's layout: one tab a level, properties in catalogue order, only what has been set."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal
from xml.sax.saxutils import escape, quoteattr

from osimlite.document.lexical import formatter
from osimlite.files import write_atomically
from osimlite.schema.base import Component, FieldSpec, Layout, Object, Remark, Unknown, field_specs
from osimlite.schema.fields import Held, Reference
from osimlite.schema.model import CURRENT_VERSION, Model

Numbers = Literal["shortest", "opensim"]


def to_text(model: Model, *, numbers: Numbers = "shortest", comments: bool = True) -> str:
    """The document of a model.

    Args:
        model: what to print; components given as references must be part of it.
        numbers: ``"shortest"`` prints the shortest decimal that reads back equal, ``"opensim"`` 17 significant digits.
        comments: whether to print the comments the model was read with.

    Raises:
        ModelError: a reference leads to a component outside the model.
    """
    printer = _Printer(model, numbers, comments)
    layout = model.layout or Layout()
    lines = printer.lines
    lines.append('<?xml version="1.0" encoding="UTF-8" ?>')
    printer.comment(layout.prolog, 0)
    lines.append(f'<OpenSimDocument Version="{CURRENT_VERSION}">')
    printer.object(model, model.name, 1)
    lines.append("</OpenSimDocument>")
    printer.comment(layout.epilog, 0)
    return "\n".join(lines) + "\n"


def write(model: Model, path: str | Path, *, numbers: Numbers = "shortest") -> None:
    """Write a model file; it appears whole or not at all. Arguments and errors as `to_text`."""
    write_atomically(path, to_text(model, numbers=numbers))


class _Printer:
    def __init__(self, model: Model, numbers: str, comments: bool) -> None:
        self.tree = model.tree()
        self.numbers = numbers
        self.comments = comments
        self.lines: list[str] = []

    def object(self, item: Object, name: str, depth: int) -> None:
        """Print one object as an element with this name attribute."""
        indent = "\t" * depth
        layout = item.layout
        if layout is not None:
            self.comment(layout.comments, depth)
        if isinstance(item, Unknown):
            self._element(item.content, depth)
        else:
            head = f"{indent}<{item.tag}" + (f" name={quoteattr(name)}" if name else "")
            if layout is not None:
                head += "".join(f" {key}={quoteattr(text)}" for key, text in layout.attributes.items())
            self.lines.append(head + ">")
            present = item.model_fields_set
            for spec in field_specs(type(item)).values():
                if layout is not None and layout.before and spec.tag in layout.before:
                    self._remarks(layout.before[spec.tag], depth + 1)
                value = getattr(item, spec.name)
                if spec.name in present or (isinstance(spec.kind, Held) and has_content(value)):
                    self._property(item, spec, value, depth + 1)
            if layout is not None and None in layout.before:
                self._remarks(layout.before[None], depth + 1)
            self.lines.append(f"{indent}</{item.tag}>")
        if layout is not None and layout.after:
            self._remarks(layout.after, depth)

    def _property(self, item: Object, spec: FieldSpec, value: Any, depth: int) -> None:
        kind = spec.kind
        indent = "\t" * depth
        if not isinstance(kind, Held):
            text = self._text(item, spec, value)
            self.lines.append(f"{indent}<{spec.tag}>{text}</{spec.tag}>")
        elif kind.form == "single":
            self.object(value, spec.tag, depth)
        elif kind.form == "unnamed":
            self.object(value, value.name, depth)
        else:
            members = value if isinstance(value, list) else [] if value is None else [value]
            if not members:
                self.lines.append(f"{indent}<{spec.tag} />")
                return
            self.lines.append(f"{indent}<{spec.tag}>")
            for member in members:
                self.object(member, member.name, depth + 1)
            self.lines.append(f"{indent}</{spec.tag}>")

    def _text(self, item: Object, spec: FieldSpec, value: Any) -> str:
        if isinstance(spec.kind, Reference):
            value = self._named(item, spec.kind, value)
        layout: Layout | None = item.layout
        if layout is not None and spec.name in layout.raw:
            read_as, raw = layout.raw[spec.name]
            if read_as is value or read_as == value:
                return escape(raw)
        return escape(formatter(spec.kind, self.numbers)(value))

    def _named(self, item: Object, reference: Reference, value: Any) -> Any:
        if isinstance(value, Component):
            return self.tree.text_for(self.tree.owner_of(item), reference, value)
        if isinstance(value, tuple):
            return tuple(self._named(item, reference, word) for word in value)
        return "" if value is None else value

    def _remarks(self, remarks: list[Remark], depth: int) -> None:
        for remark in remarks:
            if remark.element:
                self._element(remark.text, depth)
            else:
                self.comment([remark.text], depth)

    def comment(self, texts: list[str], depth: int) -> None:
        """Print comments, one a line."""
        if self.comments:
            indent = "\t" * depth
            self.lines.extend(f"{indent}<!--{text}-->" for text in texts)

    def _element(self, xml: str, depth: int) -> None:
        """Print foreign XML as it was; only its last line's indent follows ours."""
        self.lines.append("\t" * depth + xml)


def has_content(value: Any) -> bool:
    """Whether an object or list that no one assigned holds something all the same."""
    if isinstance(value, list):
        return bool(value)
    if not isinstance(value, Object):
        return False
    if value.model_fields_set - {"name"} or value.layout is not None:
        return True
    return any(has_content(held) for _, held in value.objects_held())
