"""Random single faults in complete projects, and changes without any effect."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.lint import document_faults as documents
from tests.lint import table_faults as tables
from tests.lint.document_faults import leaf_like, new_value
from tests.lint.projects import Change, Fault, Project, misspelt
from tests.oracle.structural_edits import Text


def file_name(project: Project, draw: random.Random) -> Change | None:
    leaf = leaf_like(project, draw, lambda text: text in project.texts)
    if leaf is None:
        return None
    old = leaf[1].inside(leaf[2]).strip()
    other = draw.choice(
        [name for name in sorted(project.texts) if Path(name).suffix != Path(old).suffix]
    )
    new = draw.choice(
        (
            misspelt(draw, old),
            f".\\{old}",
            f"data/{old}",
            f"../{old}",
            old.upper(),
            Path(old).stem,
            other,
            f'"{old}"',
        )
    )
    is_there = new in project.texts
    return new_value(*leaf, new, sure=not is_there or leaf[2].tag != "states_file", words=())


def file_gone(project: Project, draw: random.Random) -> Change | None:
    file = draw.choice([name for name in sorted(project.texts) if project.users(name)])
    return Change(file, "is not there", None, (), sure=True)


def file_of_another_kind(project: Project, draw: random.Random) -> Change | None:
    file = draw.choice([name for name in sorted(project.texts) if project.users(name)])
    other = draw.choice([name for name in sorted(project.texts) if name != file])
    new = draw.choice(("", "\n", "no table and no document\n", project.texts[other]))
    what = (
        "is empty"
        if not new.strip()
        else "holds words"
        if new.startswith("no ")
        else f"holds {other}"
    )
    lines = tuple(range(1, new.count("\n") + 2))
    return Change(file, what, new, lines, sure=not new.strip() or new.startswith("no "))


KINDS: tuple[Callable[[Project, random.Random], Change | None], ...] = (
    documents.name_misspelt, documents.name_of_another_kind, documents.path_for_a_name, documents.name_in_the_model,
    documents.text_for_a_number, documents.number_out_of_range, documents.count_of_numbers, documents.times,
    documents.wrong_bool, documents.other_bool, documents.word_misspelt, documents.tag_misspelt,
    documents.tag_of_another, documents.element_twice, documents.element_moved, documents.element_gone,
    documents.value_gone, documents.broken_markup, documents.version, documents.root_tag,
    file_name, file_gone, file_of_another_kind,
    tables.header_key, tables.header_value, tables.label, tables.column_gone, tables.columns_swapped, tables.cell,
    tables.row, tables.time, tables.cut_off, tables.other_units,
)  # fmt: skip
"""Functions that make one kind of fault each."""

UNKNOWABLE = {
    "number_out_of_range": "the number may be one that is meant",
    "count_of_numbers": "a list may be longer or shorter",
    "wrong_bool": "one that OpenSim reads may be meant: those that it does not read are sure",
    "other_bool": "either may be meant",
    "element_twice": "of a set, a second member",
    "element_moved": "an object may belong to another set",
    "element_gone": "what is not there has a default",
    "value_gone": "an empty list is a list",
    "column_gone": "a study may follow fewer columns",
    "columns_swapped": "values that either might have",
    "other_units": "values that are possible in them too",
    "version": "a document may be of any version",
}
"""Why a fault of these kinds, unless it is sure, may leave a project that is still valid."""


def faults(project: Project, draw: random.Random) -> Iterator[Fault]:
    """Yield random faults without end."""
    while True:
        kind = draw.choice(KINDS)
        change = kind(project, draw)
        if change is None or change.text == project.texts[change.file]:
            continue
        places = {(change.file, line) for line in change.lines} | {
            *project.users(change.file).items()
        }
        for word in filter(None, change.words):
            places |= project.places_of(word)
            for table in project.tables.values():
                places |= set(project.users(table.name).items()) if word in table.labels else set()
        yield Fault(
            kind.__name__, f"{change.file}: {change.what}", change.file, {change.file: change.text}, frozenset(places),
            change.sure,
        )  # fmt: skip


def harmless(project: Project, draw: random.Random) -> Iterator[Fault]:
    """Yield random changes that have no effect in OpenSim, without end."""
    while True:
        name = draw.choice(sorted({*project.documents, *project.tables}))
        text = project.texts[name]
        what, new = "", text
        if name in project.tables:
            what = draw.choice(("CRLF", "blank line at the end"))
            new = text.replace("\n", "\r\n") if what == "CRLF" else text + "\n"
        else:
            what, new = _same_document(project.documents[name], draw)
        if new != text:
            yield Fault("harmless", f"{name}: {what}", name, {name: new}, frozenset(), False)


def _same_document(text: Text, draw: random.Random) -> tuple[str, str]:
    element = text.any(draw)
    leaf = text.any(draw, text.leaves)
    what = draw.choice(
        ("comment", "blanks", "CRLF", "order", "lines", "no indent", "double quotes")
    )
    if what == "comment":
        return what, text.put(
            (element.start, element.start, "<!-- a remark, with <tags> & more -->")
        )
    if what == "blanks":
        return what, text.put((leaf.head, leaf.head, " \n\t"), (leaf.tail, leaf.tail, "\t\n "))
    if what == "CRLF":
        return what, text.text.replace("\n", "\r\n")
    if what == "lines":
        return what, text.text.replace(">\n", ">\n\n")
    if what == "no indent":
        return what, text.text.replace("\t", "")
    if what == "double quotes":
        return "single quotes", re.sub(r'(name|Version)="([^"]*)"', r"\1='\2'", text.text)
    # The order of properties has no meaning, but the order of objects in a set does.
    siblings = [other for other in text.siblings(element) if other.tag != element.tag]
    others = [o for o in siblings if o.end <= element.start or o.start >= element.end]
    if element.tag[0].isupper() or not others:
        return what, text.text
    other = draw.choice(others)
    return f"{element.tag} and {other.tag} swapped", text.put(
        (element.start, element.end, text.whole(other)),
        (other.start, other.end, text.whole(element)),
    )
