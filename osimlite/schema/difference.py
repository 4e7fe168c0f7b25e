"""Differences in meaning between two documents, independent of their layout.

Components of models are matched by path. Other documents are compared property by property.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import zip_longest
from typing import Any, NamedTuple

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
        old: first document.
        new: second document.
    """
    if isinstance(old, Model) and isinstance(new, Model):
        # Only models have a tree of components with paths.
        return list(_Comparison(old.tree(), new.tree()).run())
    return list(_Comparison(None, None)._object(new.name or new.tag, "", old, new))


class _Comparison:
    """Comparison of two models by their trees, or of two other objects, which have no tree."""

    def __init__(self, old: Tree | None, new: Tree | None) -> None:
        self.old = old
        self.new = new

    def run(self) -> Iterator[Difference]:
        assert self.old is not None and self.new is not None
        # What only the old model has comes first, then the differences of what both have, then
        # what only the new one has.
        for path in _find_missing_paths(self.old, self.new):
            yield Difference(path, "", _describe_type(self.old.by_path[path]), None)
        for path, component in self.new.by_path.items():
            before = self.old.by_path.get(path)
            # A component that only the new model has is reported below, once for its whole
            # subtree.
            if before is not None:
                yield from self._object(path, "", before, component)
        for path in _find_missing_paths(self.new, self.old):
            yield Difference(path, "", None, _describe_type(self.new.by_path[path]))

    def _object(self, path: str, way: str, old: Object, new: Object) -> Iterator[Difference]:
        """Compare two objects at the same position; `way` is the property that leads to them.

        Yields:
            Differences of their class and properties.
        """
        if _describe_type(old) != _describe_type(new):
            yield Difference(path, way or "class", _describe_type(old), _describe_type(new))
            # An owned object of another class is reported as a whole. Of a component at its path
            # the properties that both classes have are compared as well.
            if way:
                return
        if isinstance(old, Unknown) or isinstance(new, Unknown):
            if isinstance(old, Unknown) and isinstance(new, Unknown) and old.content != new.content:
                # The properties of an unknown class are only text. If one class is known, the
                # difference of the classes has been reported.
                yield from _compare_contents(path, way, old.content, new.content)
            return
        # If the classes differ, compare the properties that both have.
        for spec in [
            spec
            for tag, spec in get_field_specs(type(new)).items()
            if tag in get_field_specs(type(old))
        ]:
            place = f"{way}.{spec.tag}" if way else spec.tag
            one, other = getattr(old, spec.name), getattr(new, spec.name)
            if isinstance(spec.kind, ObjectField):
                yield from self._compare_owned(
                    path, place, spec.kind.form == "list", _list_objects(one), _list_objects(other)
                )
            elif isinstance(spec.kind, Reference):
                # References are compared by the components that they lead to: a path and a name
                # can mean the same one.
                names = (
                    self._names(self.old, old, spec, one),
                    self._names(self.new, new, spec, other),
                )
                if names[0] != names[1]:
                    yield Difference(path, place, *names)
            elif not _are_equal(one, other):
                yield Difference(path, place, one, other)

    def _compare_owned(
        self, path: str, way: str, named: bool, old: list[Object], new: list[Object]
    ) -> Iterator[Difference]:
        """Compare objects without a path; components are compared at their own path.

        `named` says whether the names of the objects count.

        Yields:
            Differences of the objects.
        """
        before = [item for item in old if self.old is None or not isinstance(item, Component)]
        after = [item for item in new if self.new is None or not isinstance(item, Component)]
        if (
            self.old is None
            and named
            and (old_names := _index_by_name(before))
            and (new_names := _index_by_name(after))
        ):
            # Outside of models members have no paths, so match them by name.
            for name in dict.fromkeys([*old_names, *new_names]):
                yield from self._pair(
                    path, f"{way}[{name}]", old_names.get(name), new_names.get(name)
                )
            return
        # A single object needs no number in its place; positions decide where names are missing
        # or repeated.
        many = max(len(before), len(after)) > 1
        for number, (one, other) in enumerate(zip_longest(before, after)):
            place = f"{way}[{number}]" if many else way
            if named and one is not None and other is not None and one.name != other.name:
                yield Difference(path, f"{place}.name", one.name, other.name)
            yield from self._pair(path, place, one, other)

    def _pair(
        self, path: str, place: str, old: Object | None, new: Object | None
    ) -> Iterator[Difference]:
        """Compare two objects, either of which may be missing.

        Yields:
            Differences of the objects.
        """
        if old is not None and new is not None:
            yield from self._object(path, place, old, new)
        elif old is not None or new is not None:
            yield Difference(path, place, old and _describe_type(old), new and _describe_type(new))

    def _names(self, tree: Tree | None, holder: Object, spec: FieldSpec, value: Any) -> Any:
        """Return a reference in canonical form: the path of its component if it leads to one."""
        if isinstance(value, tuple):
            return tuple(self._names(tree, holder, spec, word) for word in value)
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


_MARKUP = re.compile(
    r"<!--.*?-->|<!\[CDATA\[(?P<section>.*?)\]\]>|<\?.*?\?>|"
    r"<(?P<close>/?)(?P<tag>[^\s/<>!?]+)(?P<attributes>[^<>]*?)(?P<empty>/?)>",
    re.DOTALL,
)
_ATTRIBUTE = re.compile(r"([^\s=]+)\s*=\s*(\"[^\"]*\"|'[^']*')")


def _compare_contents(path: str, way: str, old: str, new: str) -> Iterator[Difference]:
    """Yield the values that differ in the XML of two objects of an unknown class.

    White space around values and between elements, comments, and the spelling of numbers do not
    count.
    """
    before, after = _flatten_content(old), _flatten_content(new)
    for place in dict.fromkeys([*before, *after]):
        one, other = before.get(place), after.get(place)
        if one is None or other is None or not _have_same_words(one, other):
            what = f"{way}.{place}" if way and place else way or place or "content"
            yield Difference(path, what, one, other)


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
            place = ""
            if levels:
                word = f"{match['tag']}[{name}]" if name else match["tag"]
                above = levels[-1]
                above.has_children = True
                # Elements with equal tags and names are counted, so that each keeps a place of
                # its own.
                number = above.counts.get(word, 0)
                above.counts[word] = number + 1
                word += f"({number + 1})" if number else ""
                place = f"{above.place}.{word}" if above.place else word
            for attribute, value in attributes.items():
                result[f"{place}@{attribute}"] = value
            levels.append(_Level(place))
        if (match["close"] or match["empty"]) and levels:
            level = levels.pop()
            # White space between child elements is no value. An empty element without children is
            # one.
            if level.place and (level.text.strip() or not level.has_children):
                result[level.place] = level.text.strip()
    return result


class _Level:
    """Element of an XML fragment while it is parsed."""

    def __init__(self, place: str) -> None:
        self.place = place
        self.text = ""
        self.has_children = False
        self.counts: dict[str, int] = {}


def _have_same_words(one: str, other: str) -> bool:
    """Return whether two texts have the same words, or numbers."""
    words, others = one.split(), other.split()
    return len(words) == len(others) and all(map(_are_same_word, words, others))


def _are_same_word(one: str, other: str) -> bool:
    if one == other:
        return True
    try:
        # 1 and 1.0 are the same number.
        return float(one) == float(other)
    except ValueError:
        return False


def _list_objects(value: Any) -> list[Object]:
    return value if isinstance(value, list) else [] if value is None else [value]


def _index_by_name(items: list[Object]) -> dict[str, Object]:
    """Return objects by name; empty if a name is missing or occurs twice."""
    # A dictionary with fewer entries than items shows that a name occurs twice.
    result = {item.name: item for item in items}
    return result if len(result) == len(items) and "" not in result else {}


def _describe_type(item: Object) -> str:
    return item.class_name if isinstance(item, Unknown) else item.tag


def _are_equal(one: Any, other: Any) -> bool:
    # NaN differs from itself, but its text does not.
    return bool(one == other) or repr(one) == repr(other)


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
