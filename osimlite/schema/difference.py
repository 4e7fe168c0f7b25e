"""Differences in meaning between two documents, independent of their layout.

Components of models are matched by path. Other documents are compared property by property.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import zip_longest
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.fields import ObjectField, Reference
from osimlite.schema.model import Model
from osimlite.schema.specs import FieldSpec, get_field_specs
from osimlite.schema.tree import Tree, Use


class Difference(NamedTuple):
    """One difference.

    Attributes:
        path: path of the component.
        what: property, with the path to it inside the component; empty for a whole component.
        old: previous value, of a component its class; None if it was added.
        new: new value, of a component its class; None if it was removed.
    """

    path: str
    what: str
    old: Any
    new: Any


def find_differences(old: Object, new: Object) -> list[Difference]:
    """Return every difference in meaning from `old` to `new`, in tree order.

    A property that is missing equals one with its default value.

    Args:
        old: object at the top of the first document.
        new: object at the top of the second document.
    """
    if isinstance(old, Model) and isinstance(new, Model):
        # Only models have a tree of components with paths.
        return list(_Comparison(old.tree(), new.tree()).run())
    return list(_Comparison(None, None)._compare_objects(new.name or new.tag, "", old, new))


class _Comparison:
    """Comparison of two models by their trees, or of two other objects, which have no tree."""

    def __init__(self, old: Tree | None, new: Tree | None) -> None:
        self.old = old
        self.new = new

    def run(self) -> Iterator[Difference]:
        """Yield the differences of two models: removed, changed, then added components."""
        assert self.old is not None and self.new is not None
        # Components of the old model alone come first, then the differences of components that both
        # have, then components of the new model alone.
        for path in _find_missing_paths(self.old, self.new):
            yield Difference(path, "", _describe_type(self.old.by_path[path]), None)
        for path, component in self.new.by_path.items():
            before = self.old.by_path.get(path)
            # A component that only the new model has is reported below, once for its whole
            # subtree.
            if before is not None:
                yield from self._compare_objects(path, "", before, component)
        for path in _find_missing_paths(self.new, self.old):
            yield Difference(path, "", None, _describe_type(self.new.by_path[path]))

    def _compare_objects(
        self, path: str, property_path: str, old: Object, new: Object
    ) -> Iterator[Difference]:
        """Compare two objects at the same position; `property_path` is the property that leads to them.

        Yields:
            Differences of their class and properties.
        """
        if _describe_type(old) != _describe_type(new):
            yield Difference(
                path, property_path or "class", _describe_type(old), _describe_type(new)
            )
            # An owned object of another class is reported as a whole. The properties of a component
            # at its path are compared as well.
            if property_path:
                return
        if isinstance(old, Unknown) or isinstance(new, Unknown):
            if isinstance(old, Unknown) and isinstance(new, Unknown) and old.content != new.content:
                # The properties of an unknown class are only text. If one class is known, the
                # difference of the classes has been reported.
                yield from _compare_contents(path, property_path, old.content, new.content)
            return
        old_specs, new_specs = get_field_specs(type(old)), get_field_specs(type(new))
        for tag, spec in (old_specs | new_specs).items():
            child_path = f"{property_path}.{tag}" if property_path else tag
            if tag not in new_specs or tag not in old_specs:
                yield from self._report_unmatched_property(path, child_path, spec, old, new)
                continue
            spec = new_specs[tag]
            old_value, new_value = getattr(old, spec.name), getattr(new, spec.name)
            if isinstance(spec.kind, ObjectField):
                yield from self._compare_owned(
                    path,
                    child_path,
                    spec.kind.form == "list",
                    _list_objects(old_value),
                    _list_objects(new_value),
                )
            elif isinstance(spec.kind, Reference):
                # References are compared by the components that they lead to: a path and a name
                # can mean the same one.
                names = (
                    self._canonicalize_reference(self.old, old, spec, old_value),
                    self._canonicalize_reference(self.new, new, spec, new_value),
                )
                if names[0] != names[1]:
                    yield Difference(path, child_path, *names)
            elif not _are_equal(old_value, new_value):
                yield Difference(path, child_path, old_value, new_value)

    def _report_unmatched_property(
        self, path: str, property_path: str, spec: FieldSpec, old: Object, new: Object
    ) -> Iterator[Difference]:
        """Report a property that the class of only one of two objects has.

        Yields:
            The property as added or removed, unless it has its default value.
        """
        is_old = spec.tag in get_field_specs(type(old))
        holder = old if is_old else new
        tree = self.old if is_old else self.new
        value = getattr(holder, spec.name)
        if isinstance(spec.kind, ObjectField):
            # Components are compared at their own paths.
            objects = [
                item
                for item in _list_objects(value)
                if tree is None or not isinstance(item, Component)
            ]
            defaults = _list_objects(spec.factory() if spec.factory is not None else None)
            is_list = spec.kind.form == "list"
            # Default objects are in no tree.
            if any(_Comparison(None, None)._compare_owned("", "", is_list, defaults, objects)):
                sides = (objects, []) if is_old else ([], objects)
                yield from self._compare_owned(path, property_path, is_list, *sides)
        elif not _are_equal(value, spec.default):
            if isinstance(spec.kind, Reference):
                value = self._canonicalize_reference(tree, holder, spec, value)
            yield Difference(path, property_path, *((value, None) if is_old else (None, value)))

    def _compare_owned(
        self, path: str, property_path: str, are_named: bool, old: list[Object], new: list[Object]
    ) -> Iterator[Difference]:
        """Compare objects without a path; components are compared at their own path.

        `are_named` says whether the names of the objects count.

        Yields:
            Differences of the objects.
        """
        old_objects = [item for item in old if self.old is None or not isinstance(item, Component)]
        new_objects = [item for item in new if self.new is None or not isinstance(item, Component)]
        if (
            self.old is None
            and are_named
            and (old_names := _index_by_name(old_objects))
            and (new_names := _index_by_name(new_objects))
        ):
            # Outside of models members have no paths, so match them by name.
            for name in dict.fromkeys([*old_names, *new_names]):
                yield from self._compare_pair(
                    path, f"{property_path}[{name}]", old_names.get(name), new_names.get(name)
                )
            return
        # A single object needs no number in its place; positions decide where names are missing
        # or repeated.
        has_several = max(len(old_objects), len(new_objects)) > 1
        for number, (old_object, new_object) in enumerate(zip_longest(old_objects, new_objects)):
            item_path = f"{property_path}[{number}]" if has_several else property_path
            if (
                are_named
                and old_object is not None
                and new_object is not None
                and old_object.name != new_object.name
            ):
                yield Difference(path, f"{item_path}.name", old_object.name, new_object.name)
            yield from self._compare_pair(path, item_path, old_object, new_object)

    def _compare_pair(
        self, path: str, property_path: str, old: Object | None, new: Object | None
    ) -> Iterator[Difference]:
        """Compare two objects; one of them may be missing.

        Yields:
            Differences of the objects.
        """
        if old is not None and new is not None:
            yield from self._compare_objects(path, property_path, old, new)
        elif old is not None or new is not None:
            yield Difference(
                path, property_path, old and _describe_type(old), new and _describe_type(new)
            )

    def _canonicalize_reference(
        self, tree: Tree | None, holder: Object, spec: FieldSpec, value: Any
    ) -> Any:
        """Return a reference in canonical form: the path of its component if it leads to one."""
        if isinstance(value, tuple):
            return tuple(self._canonicalize_reference(tree, holder, spec, word) for word in value)
        if value is None:
            return None
        assert isinstance(spec.kind, Reference)
        # Without a tree nothing can be looked up, so the text itself counts.
        if tree is None:
            return value if isinstance(value, str) else value.path
        owner = tree.owner_of(holder)
        # References by these rules do not lead to a component of their own; their text counts.
        if spec.kind.rule not in ("input", "file", "column", "positional", "point-index"):
            target = tree.resolve(Use(holder, owner, spec, value)).target
            if target is not None:
                return tree.path_of(target)
        # A reference that leads nowhere keeps its text.
        return value if isinstance(value, str) else value.name


_MARKUP = compile_later(
    r"<!--.*?-->|<!\[CDATA\[(?P<section>.*?)\]\]>|<\?.*?\?>|"
    r"<(?P<close>/?)(?P<tag>[^\s/<>!?]+)(?P<attributes>[^<>]*?)(?P<empty>/?)>",
    re.DOTALL,
)
_ATTRIBUTE = compile_later(r"([^\s=]+)\s*=\s*(\"[^\"]*\"|'[^']*')")


def _compare_contents(path: str, property_path: str, old: str, new: str) -> Iterator[Difference]:
    """Yield the values that differ in the XML of two objects of an unknown class.

    White space around values and between elements, comments, and the spelling of numbers do not
    count.
    """
    old_texts, new_texts = _flatten_content(old), _flatten_content(new)
    for tag_path in dict.fromkeys([*old_texts, *new_texts]):
        old_text, new_text = old_texts.get(tag_path), new_texts.get(tag_path)
        if old_text is None or new_text is None or not _have_same_words(old_text, new_text):
            full_path = (
                f"{property_path}.{tag_path}"
                if property_path and tag_path
                else property_path or tag_path or "content"
            )
            yield Difference(path, full_path, old_text, new_text)


def _flatten_content(content: str) -> dict[str, str]:
    """Return the texts of an XML fragment by the tags, and names, that lead to them below its first element."""
    result: dict[str, str] = {}
    levels: list[_Level] = []
    end = 0
    for match in _MARKUP.finditer(content):
        # Text between two tags belongs to the element that is open; white space is removed at its
        # end.
        if levels:
            levels[-1].text += content[end : match.start()] + (match["section"] or "")
        end = match.end()
        # Comments, CDATA sections and instructions are no elements.
        if match["tag"] is None:
            continue
        if not match["close"]:
            attributes = {
                name: value[1:-1] for name, value in _ATTRIBUTE.findall(match["attributes"])
            }
            # A name identifies an element among its siblings, so that it is part of the place and
            # no value.
            name = attributes.pop("name", "")
            element_path = ""
            if levels:
                element_name = f"{match['tag']}[{name}]" if name else match["tag"]
                above = levels[-1]
                above.has_children = True
                # Elements with equal tags and names are counted, so that each keeps a place of
                # its own.
                number = above.counts.get(element_name, 0)
                above.counts[element_name] = number + 1
                element_name += f"({number + 1})" if number else ""
                element_path = f"{above.path}.{element_name}" if above.path else element_name
            for attribute, value in attributes.items():
                result[f"{element_path}@{attribute}"] = value
            levels.append(_Level(element_path))
        if (match["close"] or match["empty"]) and levels:
            level = levels.pop()
            # White space between child elements is no value. An empty element without children is
            # one.
            if level.path and (level.text.strip() or not level.has_children):
                result[level.path] = level.text.strip()
    return result


class _Level:
    """Element of an XML fragment while it is parsed."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.text = ""
        self.has_children = False
        self.counts: dict[str, int] = {}


def _have_same_words(left: str, right: str) -> bool:
    """Return whether two texts have the same words, or numbers."""
    left_words, right_words = left.split(), right.split()
    return len(left_words) == len(right_words) and all(map(_are_same_word, left_words, right_words))


def _are_same_word(left: str, right: str) -> bool:
    if left == right:
        return True
    try:
        # 1 and 1.0 are the same number.
        return float(left) == float(right)
    except ValueError:
        return False


def _list_objects(value: Any) -> list[Object]:
    return value if isinstance(value, list) else [] if value is None else [value]


def _index_by_name(objects: list[Object]) -> dict[str, Object]:
    """Return objects by name; empty if a name is missing or occurs twice."""
    # A dictionary with fewer entries than items shows that a name occurs twice.
    result = {item.name: item for item in objects}
    return result if len(result) == len(objects) and "" not in result else {}


def _describe_type(item: Object) -> str:
    return item.class_name if isinstance(item, Unknown) else item.tag


def _are_equal(left: Any, right: Any) -> bool:
    # NaN differs from itself, but its text does not.
    return bool(left == right) or repr(left) == repr(right)


def _find_missing_paths(tree: Tree, other: Tree) -> Iterator[str]:
    """Yield the topmost paths of a tree that another tree lacks, without internal parts."""
    # If a component is missing, all below it is too; only the topmost is reported.
    missing = {path for path in tree.by_path if path not in other.by_path}
    for path, component in tree.by_path.items():
        if (
            path in missing
            and not tree.is_internal(component)
            and not any(above in missing for above in _list_parent_paths(path))
        ):
            yield path


def _list_parent_paths(path: str) -> Iterator[str]:
    while "/" in path[1:]:
        path = path.rsplit("/", 1)[0]
        yield path
