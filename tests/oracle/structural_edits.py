"""Random edits of the text of a model, for comparisons of the linter's verdict with OpenSim's.

Edits remove, duplicate, swap, move and rename elements, and change values and names. Each edit
leaves well-formed XML, with few exceptions, that means something else. Rare tags are drawn as often
as common ones.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from osimlite.io.document.source import Source
from osimlite.schema.registry import list_tags

# Format versions that documents may state; the last one is newer than OpenSim 4.6.
VERSIONS: tuple[int, ...] = (
    10500,
    10600,
    10900,
    10901,
    10905,
    20001,
    20101,
    20302,
    20303,
    30000,
    30500,
    30501,
    30502,
    30505,
    30507,
)
VERSIONS += (30508, 30510, 30512, 30514, 30516, 30517, 40000, 40500, 40600, 40601)
# Texts that replace a value.
VALUES: tuple[str, ...] = (
    "",
    "NaN",
    "abc",
    "0",
    "-1",
    "1",
    "1e30",
    "-1e30",
    "1e400",
    "1e-320",
    "Inf",
    "true",
    "false",
    "1,5",
    "1 2 3",
)
VALUES += (
    "0 0 0",
    "0.5 0.5",
    "1 2 3 4 5 6",
    "0 0 0 0 0 0",
    "1 1 1 0 0 0 0",
    "NaN 0 0",
    "0 0 0 a 0 0",
    "1 2 3 4 5 6 7 8",
)


CHANGES: tuple[Callable[[random.Random, str, list[str]], str], ...] = (
    lambda draw, word, names: word[: (at := draw.randrange(len(word)))] + word[at + 1 :],
    lambda draw, word, names: word[: (at := draw.randrange(len(word)))] + word[at] + word[at:],
    lambda draw, word, names: word[: (at := draw.randrange(len(word)))] + word[at:].swapcase(),
    lambda draw, word, names: word.lower(),
    lambda draw, word, names: draw.choice(names),
    lambda draw, word, names: draw.choice(names),
    lambda draw, word, names: draw.choice(names).rpartition("/")[2],
    lambda draw, word, names: word.rpartition("/")[2],
    lambda draw, word, names: word.rpartition("/")[0],
    lambda draw, word, names: word.lstrip("/"),
    lambda draw, word, names: f"/{word}",
    lambda draw, word, names: f"{word}/",
    lambda draw, word, names: f"{word},",
    lambda draw, word, names: word.replace("/", "//"),
    lambda draw, word, names: f"./{word}",
    lambda draw, word, names: f"../{word}",
    lambda draw, word, names: f"../../{word.lstrip('/')}",
    lambda draw, word, names: f"/bodyset/{word}",
    lambda draw, word, names: f"/forceset/{word}",
    lambda draw, word, names: f"/contactgeometryset/{word}",
    lambda draw, word, names: f" {word} ",
    lambda draw, word, names: f"{word[: len(word) // 2]} {word[len(word) // 2 :]}",
    lambda draw, word, names: f"{word}*",
    lambda draw, word, names: "/ground",
    lambda draw, word, names: "all",
    lambda draw, word, names: "UNASSIGNED",
    lambda draw, word, names: "",
    lambda draw, word, names: " \n\t ",
    lambda draw, word, names: word.upper(),
    lambda draw, word, names: f"{word}/.",
    lambda draw, word, names: f"{word}/..",
    lambda draw, word, names: f"{word}/../{word.rpartition('/')[2]}",
    lambda draw, word, names: f"../../{word.rpartition('/')[2]}",
    lambda draw, word, names: f"../../../..{word}",
    lambda draw, word, names: f"{word} {word}",
    lambda draw, word, names: f"{word} {draw.choice(names)}",
    lambda draw, word, names: f"{word}, {draw.choice(names)}",
    lambda draw, word, names: f"{word}\\",
    lambda draw, word, names: f"<!-- was {word} -->",
    lambda draw, word, names: f"<![CDATA[{word}]]>",
    lambda draw, word, names: f"{word}\u00a0",
    lambda draw, word, names: f"/jointset/{word.rpartition('/')[2]}",
    lambda draw, word, names: f"/markerset/{word.rpartition('/')[2]}",
)
"""Functions that change a word that names a component, given the names in the model."""


class Edit(NamedTuple):
    """Edited text, and a description of the edit."""

    what: str
    text: str


class Element(NamedTuple):
    """Element of a text: tag, index of its parent, and offsets in the text."""

    tag: str
    parent: int  # index in `Text.elements`, -1 at the top
    start: int
    head: int  # end of the start tag
    tail: int  # beginning of the end tag
    end: int


class Text:
    """Text of a model, with its elements grouped by tag."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.elements: list[Element] = []
        above: list[int] = []
        for number, span in enumerate(Source(text.encode()).spans):
            while above and self.elements[above[-1]].end <= span.start:
                above.pop()
            parent = above[-1] if above else -1
            self.elements.append(
                Element(span.tag, parent, span.start, span.tag_end, span.inner_end, span.end)
            )
            above.append(number)
        self.by_tag: dict[str, list[Element]] = {}
        for element in self.elements[2:]:
            self.by_tag.setdefault(element.tag, []).append(element)
        parents = {element.parent for element in self.elements}
        self.leaves: dict[str, list[Element]] = {}
        for number, element in enumerate(self.elements):
            if number not in parents and self.inside(element):
                self.leaves.setdefault(element.tag, []).append(element)
        self.named: dict[str, list[Element]] = {}
        for element in self.elements[1:]:
            if _NAME.search(self.head(element)):
                self.named.setdefault(element.tag, []).append(element)
        elements = [element for group in self.named.values() for element in group]
        matches = [_NAME.search(self.head(element)) for element in elements]
        self.names = sorted({match[1] for match in matches if match})

    def whole(self, element: Element) -> str:
        return self.text[element.start : element.end]

    def head(self, element: Element) -> str:
        return self.text[element.start : element.head]

    def inside(self, element: Element) -> str:
        return self.text[element.head : element.tail] if element.end > element.head else ""

    def path(self, element: Element) -> str:
        """Return the tags of the innermost ancestors and of the element, for messages."""
        words = [element.tag]
        while element.parent > 1:
            element = self.elements[element.parent]
            words.append(element.tag)
        return "/".join(reversed(words[:4]))

    def siblings(self, element: Element) -> list[Element]:
        return [
            other
            for other in self.elements
            if other.parent == element.parent and other is not element
        ]

    def any(self, draw: random.Random, groups: dict[str, list[Element]] | None = None) -> Element:
        """Return a random element.

        In half of the cases each tag is equally likely, in the others each element.
        """
        groups = self.by_tag if groups is None else groups
        if draw.random() < 0.5:
            return draw.choice(groups[draw.choice(sorted(groups))])
        return draw.choice([element for tag in sorted(groups) for element in groups[tag]])

    def put(self, *changes: tuple[int, int, str]) -> str:
        """Return the text with each range of offsets replaced by a new text."""
        text = self.text
        for start, end, new in sorted(changes, reverse=True):
            text = text[:start] + new + text[end:]
        return text


Operation = Callable[[Text, random.Random], "tuple[str, str] | None"]

_NAME = re.compile(r'\sname="([^"<]+)"')


def _attribute(text: Text, draw: random.Random) -> tuple[str, str] | None:
    """Add, remove, rename or repeat an attribute."""
    element = text.any(draw, text.named if draw.random() < 0.6 else None)
    head = text.head(element)
    name = _NAME.search(head)
    open_end = len(head) - (2 if head.endswith("/>") else 1)
    choices = [
        head[:open_end]
        + f' {draw.choice(["id", "Name", "class", "type", "version", "mass"])}="{draw.choice(["", "1", "a"])}"'
        + head[open_end:],
        head[:open_end]
        + f' file="{draw.choice(["", "missing.xml", "missing.osim"])}"'
        + head[open_end:],
    ]
    if name is None:
        choices.append(
            head[:open_end] + f' name="{draw.choice(text.names or ["a"])}"' + head[open_end:]
        )
    else:
        choices += [
            head.replace(name[0], ""),
            head.replace(name[0], ' name=""'),
            head.replace(name[0], f' Name="{name[1]}"'),
            head.replace(name[0], f'{name[0]} name="{draw.choice(text.names)}"'),
        ]
    new = draw.choice(choices)
    return f"{text.path(element)}: {head} -> {new}", text.put((element.start, element.head, new))


def _delete(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    return f"{text.path(element)} taken out", text.put((element.start, element.end, ""))


def _empty(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    return f"{text.path(element)} emptied", text.put(
        (element.head, element.tail, "")
    ) if text.inside(element) else None  # type: ignore[return-value]


def _unwrap(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    if not text.inside(element):
        return None
    return f"the tags around {text.path(element)} taken away", text.put(
        (element.start, element.head, ""), (element.tail, element.end, "")
    )


def _wrap(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    tag = draw.choice(sorted(text.by_tag))
    return f"<{tag}> put around {text.path(element)}", text.put(
        (element.start, element.start, f"<{tag}>"), (element.end, element.end, f"</{tag}>")
    )


def _double(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    copy = text.whole(element)
    if draw.random() < 0.3 and (name := _NAME.search(text.head(element))):
        copy = copy.replace(name[0], f' name="{name[1]}_2"', 1)
    return f"{text.path(element)} doubled", text.put((element.end, element.end, "\n" + copy))


def _targets(text: Text, element: Element, draw: random.Random) -> Element | None:
    """Return an element into which another one can be moved, or None.

    In half of the cases it has the same tag as the present parent.
    """
    if draw.random() < 0.5:
        result = text.by_tag.get(text.elements[element.parent].tag, [])
    else:
        result = text.by_tag[draw.choice(sorted(text.by_tag))]
    result = [f for f in result if not element.start <= f.start < element.end and f.end > f.head]
    return draw.choice(result) if result else None


def _copy(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    target = _targets(text, element, draw)
    if target is None:
        return None
    at = draw.choice((target.head, target.tail))
    return f"{text.path(element)} copied into {text.path(target)}", text.put(
        (at, at, text.whole(element))
    )


def _move(text: Text, draw: random.Random) -> tuple[str, str] | None:
    element = text.any(draw)
    target = _targets(text, element, draw)
    if target is None:
        return None
    at = draw.choice((target.head, target.tail))
    return f"{text.path(element)} moved into {text.path(target)}", text.put(
        (element.start, element.end, ""), (at, at, text.whole(element))
    )


def _swap(text: Text, draw: random.Random) -> tuple[str, str] | None:
    one = text.any(draw)
    kind = draw.random()
    if kind < 0.4:
        others = text.siblings(one)
    elif kind < 0.7:
        others = text.by_tag[one.tag]
    else:
        others = text.by_tag[draw.choice(sorted(text.by_tag))]
    others = [o for o in others if o.end <= one.start or o.start >= one.end]
    if not others:
        return None
    other = draw.choice(others)
    return f"{text.path(one)} and {text.path(other)} swapped", text.put(
        (one.start, one.end, text.whole(other)), (other.start, other.end, text.whole(one))
    )


def _value(text: Text, draw: random.Random) -> tuple[str, str] | None:
    if not text.leaves:
        return None
    element = text.any(draw, text.leaves)
    old = text.inside(element)
    words = old.split() or [""]
    at = draw.randrange(len(words))
    other = draw.choice(text.leaves[draw.choice(sorted(text.leaves))])
    word = draw.choice(VALUES)
    new = draw.choice(
        (
            draw.choice(VALUES),
            draw.choice(VALUES),
            " ".join(words[:at] + words[at + 1 :]),
            " ".join([*words, draw.choice(words)]),
            " ".join([*words[:at], word, *words[at + 1 :]]),
            " ".join([*words[:at], "-" + words[at].lstrip("-"), *words[at + 1 :]]),
            text.inside(other),
        )
    )
    return f"{text.path(element)}: {old[:80]!r} -> {new[:80]!r}", text.put(
        (element.head, element.tail, new)
    )


def _class(text: Text, draw: random.Random) -> tuple[str, str] | None:
    """Rename a tag to another tag of the model, to another class, or to a misspelling."""
    element = text.any(draw)
    tag = element.tag
    at = draw.randrange(len(tag))
    like = [t for t in sorted(text.by_tag) if t[0].isupper() == tag[0].isupper()]
    new = draw.choice(
        (
            draw.choice(like),
            draw.choice(sorted(text.by_tag)),
            draw.choice(sorted(list_tags())),
            draw.choice([e.tag for e in text.siblings(element)] or like),
            tag[:at] + tag[at + 1 :] or "x",
            tag.lower(),
            tag.swapcase(),
        )
    )
    if not re.match(r"[A-Za-z_]", new) or ":" in new:
        return None
    head = "<" + new + text.head(element)[1 + len(tag) :]
    changes = [(element.start, element.head, head)]
    if element.end > element.head:
        changes.append((element.tail, element.end, f"</{new}>"))
    return f"{text.path(element)} -> <{new}>", text.put(*changes)


def _version(text: Text, draw: random.Random) -> tuple[str, str] | None:
    match = re.search(r'\sVersion="([^"]*)"', text.text)
    if match is None:
        return None
    new = draw.choice(
        (
            *(f' Version="{v}"' for v in VERSIONS),
            ' Version="abc"',
            ' Version=""',
            "",
            ' version="40600"',
        )
    )
    return f"{match[0]} -> {new}", text.put((match.start(), match.end(), new))


def _reference(text: Text, draw: random.Random) -> tuple[str, str] | None:
    """Change the text of an element that names a component."""
    known = set(text.names) | {"ground"}
    groups = {
        tag: result
        for tag, leaves in text.leaves.items()
        if (result := [e for e in leaves if text.inside(e).strip().rpartition("/")[2] in known])
    }
    if not groups:
        return None
    element = text.any(draw, groups)
    old = text.inside(element).strip()
    names = [*text.names, *(text.inside(e).strip() for group in groups.values() for e in group)]
    new = draw.choice(CHANGES)(draw, old, names)
    return f"{text.path(element)}: {old!r} -> {new!r}", text.put((element.head, element.tail, new))


def _rename(text: Text, draw: random.Random) -> tuple[str, str] | None:
    """Change a name to another name of the model, or to one that does not occur."""
    if not text.named:
        return None
    element = text.any(draw, text.named)
    match = _NAME.search(text.head(element))
    assert match is not None
    old = match[1]
    new = draw.choice(
        (
            draw.choice(text.names),
            draw.choice(text.names),
            f"{old}_2",
            old.swapcase(),
            draw.choice(
                (
                    "",
                    " ",
                    f"{old} ",
                    f" {old}",
                    f"{old[:1]} {old[1:]}",
                    f"{old}/a",
                    f"{old}*",
                    "ground",
                    "..",
                )
            ),
            draw.choice(("default", "/", "é", "1", "UNASSIGNED", f"{old}_0", f"{old}_offset")),
        )
    )
    at = element.start + match.start(1)
    return f"{text.path(element)}: name {old!r} -> {new!r}", text.put((at, at + len(old), new))


# All operations; those listed several times are chosen more often.
OPERATIONS: tuple[Operation, ...] = (
    _attribute,
    _delete,
    _empty,
    _unwrap,
    _wrap,
    _double,
    _copy,
    _move,
    _swap,
    _value,
    _value,
    _class,
    _version,
    _reference,
    _rename,
)


def edits(text: Text, draw: random.Random) -> Iterator[Edit]:
    """Yield random edits of a text without end."""
    while True:
        done = draw.choice(OPERATIONS)(text, draw)
        if done is not None and done[1] is not None and done[1] != text.text:
            yield Edit(*done)
