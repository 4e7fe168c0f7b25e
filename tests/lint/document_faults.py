"""Random faults in XML documents: names, values, times, tags and versions."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

from tests.lint.projects import NUMBER, Change, Project, misspelt
from tests.oracle.structural_edits import Element, Text

_WORD = re.compile(r"""[^\s<>"']+""")
# Objects whose name attribute is the name of another component.
_NAMES_SOMETHING = ("IKMarkerTask", "IKCoordinateTask", "BodyScale", "ControlLinear", "MocoWeight")


def _document(project: Project, draw: random.Random) -> tuple[str, Text]:
    name = draw.choice(sorted(project.documents))
    return name, project.documents[name]


def leaf_like(
    project: Project, draw: random.Random, wanted: Callable[[str], bool]
) -> tuple[str, Text, Element] | None:
    name, text = _document(project, draw)
    result = {
        tag: kept
        for tag, leaves in text.leaves.items()
        if (kept := [e for e in leaves if wanted(text.inside(e).strip())])
    }
    return (name, text, text.any(draw, result)) if result else None


def _put(
    file: str, text: Text, what: str, *changes: tuple[int, int, str], around: Element | None = None,
    words: tuple[str, ...] = (), sure: bool = False,
) -> Change:  # fmt: skip
    """Return a change that replaces pieces of a document.

    Args:
        file: name of the file.
        text: its text.
        what: description of the change.
        *changes: start, end and new text of each piece.
        around: element that is changed; a finding may also stand at its parent or grandparent.
        words: names that the change is about.
        sure: whether the change is a fault in every project.
    """
    lines = set()
    shift = 0
    for start, end, new in sorted(changes):
        first = text.text.count("\n", 0, start) + 1 + shift
        lines |= set(range(first, first + new.count("\n") + 1))
        shift += new.count("\n") - text.text.count("\n", start, end)
    # A property that an object lacks may be reported at the object or at its owner.
    for _ in range(2):
        if around is not None and around.parent >= 0:
            around = text.elements[around.parent]
            lines.add(text.text.count("\n", 0, around.start) + 1)
    return Change(file, what, text.put(*changes), tuple(lines), words, sure)


def new_value(
    file: str, text: Text, leaf: Element, new: str, *, sure: bool, words: tuple[str, ...] = ()
) -> Change:
    what = f"{text.path(leaf)}: {text.inside(leaf).strip()!r} -> {new!r}"
    return _put(file, text, what, (leaf.head, leaf.tail, new), sure=sure, words=words)


def _reference(
    project: Project, draw: random.Random
) -> tuple[str, Text, int, int, str, str] | None:
    """Choose a word of a document that names something in the model or in a table.

    Returns:
        The file, its text, start and end of the word, the word, and the tag of its element; None if
        the document has no such word.
    """
    name, text = _document(project, draw)
    known = set(project.names)
    result: dict[str, list[tuple[int, int]]] = {}
    for tag, leaves in text.leaves.items():
        for leaf in leaves:
            for word in _WORD.finditer(text.inside(leaf)):
                if word[0] in known or (
                    word[0].startswith("/") and word[0].rpartition("/")[2] in known
                ):
                    result.setdefault(tag, []).append(
                        (leaf.head + word.start(), leaf.head + word.end())
                    )
    for tag in _NAMES_SOMETHING:
        for element in text.named.get(tag, ()):
            match = re.search(r'name="([^"]+)"', text.head(element))
            assert match is not None
            if re.search(r"<apply>\s*false", text.whole(element)):
                continue
            result.setdefault(tag, []).append(
                (element.start + match.start(1), element.start + match.end(1))
            )
    if not result:
        return None
    tag = draw.choice(sorted(result))
    start, end = draw.choice(result[tag])
    return name, text, start, end, text.text[start:end], tag


def name_misspelt(project: Project, draw: random.Random) -> Change | None:
    place = _reference(project, draw)
    if place is None:
        return None
    name, text, start, end, old, tag = place
    new = misspelt(draw, old)
    # OpenSim treats repeated slashes as one.
    is_known = (
        new in project.names
        or re.sub("/+", "/", new).rstrip("/") in ("", old)
        or new.lower() == "ground"
    )
    return _put(
        name, text, f"{tag}: {old!r} -> {new!r}", (start, end, new), sure=not is_known, words=(old,)
    )


def name_of_another_kind(project: Project, draw: random.Random) -> Change | None:
    place = _reference(project, draw)
    if place is None:
        return None
    name, text, start, end, old, tag = place
    kind = project.components.get(old)
    new = draw.choice(
        sorted(
            other for other, its in project.components.items() if its != kind and other not in old
        )
    )
    return _put(name, text, f"{tag}: {old!r} -> {new!r}", (start, end, new), words=(old,))


def path_for_a_name(project: Project, draw: random.Random) -> Change | None:
    place = _reference(project, draw)
    if place is None:
        return None
    name, text, start, end, old, tag = place
    last = old.rpartition("/")[2]
    new = draw.choice(
        (
            "/",
            "./",
            "/bodyset/",
            "/jointset/",
            "/forceset/",
            "/markerset/",
            "../",
            "/bodyset/bodyset/",
        )
    )
    new += last
    return _put(name, text, f"{tag}: {old!r} -> {new!r}", (start, end, new), words=(old,))


def name_in_the_model(project: Project, draw: random.Random) -> Change | None:
    """Rename a component in the model to which a setup refers."""
    place = _reference(project, draw)
    if place is None or place[4] not in project.components:
        return None
    old = place[4]
    new = misspelt(draw, old)
    model = project.texts["model.osim"]
    if new in project.names or not new:
        return None
    whole = re.compile(rf'(?<=[/>\s"]){re.escape(old)}(?=[</\s"])')
    lines = tuple(k for k, line in enumerate(model.split("\n"), 1) if whole.search(line))
    return Change(
        "model.osim", f"{old!r} is called {new!r}", whole.sub(new, model), lines, (old,), sure=True
    )


# Texts that are not numbers, or not the numbers that they seem to be.
_TEXT_FOR_NUMBER = ("abc", "1,5", "--1", "1e", "one", "0x10", "1.2.3", "true")


def _is_numeric(text: str) -> bool:
    return bool(text) and all(NUMBER.fullmatch(word) for word in text.split())


def text_for_a_number(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, _is_numeric)
    if leaf is None:
        return None
    words = leaf[1].inside(leaf[2]).split()
    at = draw.randrange(len(words))
    words[at] = draw.choice(_TEXT_FOR_NUMBER)
    # In a list a comma separates numbers, and an unknown frame is no error where joints do not need
    # it.
    is_other = words[at] == "1,5" or leaf[2].tag in ("wrt_body", "express_body")
    return new_value(*leaf, " ".join(words), sure=not is_other)


def number_out_of_range(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, _is_numeric)
    if leaf is None:
        return None
    words = leaf[1].inside(leaf[2]).split()
    at = draw.randrange(len(words))
    words[at] = draw.choice(
        ("-1", "0", "NaN", "1e30", "-1e30", "Inf", "-Inf", "-" + words[at].lstrip("-"), "0.5")
    )
    return new_value(*leaf, " ".join(words), sure=False)


def count_of_numbers(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, _is_numeric)
    if leaf is None:
        return None
    words = leaf[1].inside(leaf[2]).split()
    new = draw.choice((words[:-1], [*words, words[-1]], [*words, *words], []))
    return new_value(*leaf, " ".join(new), sure=False)


def times(project: Project, draw: random.Random) -> Change | None:
    """Make times reversed, outside of the data, or missing."""
    name, text = _document(project, draw)
    result: dict[str, list[Element]] = {
        tag: text.leaves[tag]
        for tag in ("time_range", "initial_time", "final_time")
        if tag in text.leaves
    }
    if not result:
        return None
    leaf = text.any(draw, result)
    words = text.inside(leaf).split()
    if len(words) == 2:
        new = draw.choice(
            (
                [words[1], words[0]],
                ["50", "60"],
                ["-60", "-50"],
                words[:1],
                ["NaN", words[1]],
                [words[0], "NaN"],
            )
        )
        return new_value(name, text, leaf, " ".join(new), sure=True)
    change = new_value(
        name,
        text,
        leaf,
        draw.choice(["NaN", {"initial_time": "60", "final_time": "-60"}[leaf.tag]]),
        sure=True,
    )
    # The order of times is wrong because of both of them, so the finding may be on either line.
    both = [
        text.text.count("\n", 0, other.head) + 1
        for other in (leaf, *text.siblings(leaf))
        if other.tag in result
    ]
    return change._replace(lines=tuple(both))


def wrong_bool(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, lambda text: text in ("true", "false"))
    if leaf is None:
        return None
    new = draw.choice(("yes", "no", "True", "TRUE", "1", "0", "flase", "tru", "on"))
    # OpenSim reads an invalid boolean as false, which may be the old value. In isDisabled, of old
    # versions, such a word is no sure fault.
    return new_value(
        *leaf, new, sure=new not in ("True", "TRUE", "1", "0") and leaf[2].tag != "isDisabled"
    )


def other_bool(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, lambda text: text in ("true", "false"))
    if leaf is None:
        return None
    return new_value(
        *leaf, {"true": "false", "false": "true"}[leaf[1].inside(leaf[2]).strip()], sure=False
    )


def word_misspelt(project: Project, draw: random.Random) -> Change | None:
    """Misspell a word that is neither a number nor a name of the model.

    Most of these words are options from a fixed list.
    """
    leaf = leaf_like(
        project, draw, lambda text: bool(text) and not _is_numeric(text) and text not in ("true", "false")
        and text not in project.names and text not in project.texts,
    )  # fmt: skip
    if (
        leaf is None
        or "output" in leaf[2].tag
        or "directory" in leaf[2].tag
        or leaf[2].tag in ("notes", "point_name")
    ):
        return None
    words = leaf[1].inside(leaf[2]).split()
    at = draw.randrange(len(words))
    words[at] = misspelt(draw, words[at])
    return new_value(*leaf, " ".join(words), sure=False)


def _retagged(
    name: str, text: Text, element: Element, new: str, what: str, *, sure: bool
) -> Change:
    changes = [(element.start + 1, element.start + 1 + len(element.tag), new)]
    if text.text[element.tail : element.tail + 2] == "</":
        changes.append((element.tail + 2, element.tail + 2 + len(element.tag), new))
    change = _put(name, text, what, *changes, around=element, sure=sure)
    # If a tag occurs twice, the second element is the superfluous one.
    twins = [
        text.text.count("\n", 0, other.start) + 1
        for other in text.siblings(element)
        if other.tag == new
    ]
    return change._replace(lines=(*change.lines, *twins))


def tag_misspelt(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element = text.any(draw)
    new = misspelt(draw, element.tag)
    if not re.fullmatch(r"[A-Za-z_]\w*", new):
        return None
    return _retagged(name, text, element, new, f"<{text.path(element)}> -> <{new}>", sure=True)


def tag_of_another(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element, other = text.any(draw), text.any(draw)
    if element.tag == other.tag:
        return None
    return _retagged(
        name, text, element, other.tag, f"<{text.path(element)}> -> <{other.tag}>", sure=False
    )


def element_twice(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element = text.any(draw)
    copy = text.whole(element)
    change = _put(
        name,
        text,
        f"{text.path(element)} twice",
        (element.end, element.end, "\n" + copy),
        around=element,
    )
    first = text.text.count("\n", 0, element.start) + 1
    return change._replace(lines=(*change.lines, first))


def element_moved(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element = text.any(draw)
    targets = [
        target for group in text.by_tag.values() for target in group
        if target.end > target.head and text.inside(target).lstrip().startswith("<")
        and not element.start <= target.start < element.end
    ]  # fmt: skip
    if not targets:
        return None
    target = draw.choice(targets)
    return _put(
        name, text, f"{text.path(element)} moved into {text.path(target)}", (element.start, element.end, ""),
        (target.tail, target.tail, text.whole(element)), around=element,
    )  # fmt: skip


def element_gone(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element = text.any(draw)
    return _put(
        name,
        text,
        f"{text.path(element)} is gone",
        (element.start, element.end, ""),
        around=element,
    )


def value_gone(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, bool)
    return None if leaf is None else new_value(*leaf, "", sure=False)


def broken_markup(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element = text.any(draw)
    if text.text[element.tail : element.tail + 2] != "</":
        return None
    lines = tuple(range(1, text.text.count("\n") + 2))
    what, new = draw.choice(
        (
            ("end tag missing", ""),
            ("end tag of another", "</other>"),
            ("bare &", " & "),
            ("bare <", "<"),
        )
    )
    start, end = (
        (element.tail, element.end) if new in ("", "</other>") else (element.head, element.head)
    )
    return Change(
        name, f"{text.path(element)}: {what}", text.put((start, end, new)), lines, sure=True
    )


def version(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    match = re.search(r' Version="([^"]*)"', text.text)
    assert match is not None
    new = draw.choice(("abc", "", "4.0", "10500", "20000", "20201", "30000", "40000", "99999"))
    change = _put(
        name,
        text,
        f"version {match[1]} -> {new!r}",
        (*match.span(1), new),
        sure=new in ("abc", "4.0"),
    )
    # In a document of another version every line may have another meaning.
    return (
        change if change.sure else change._replace(lines=tuple(range(1, text.text.count("\n") + 2)))
    )


def root_tag(project: Project, draw: random.Random) -> Change | None:
    name, text = _document(project, draw)
    element = text.elements[1]
    new = misspelt(draw, element.tag)
    if not re.fullmatch(r"[A-Za-z_]\w*", new):
        return None
    return _retagged(name, text, element, new, f"<{element.tag}> -> <{new}>", sure=True)
