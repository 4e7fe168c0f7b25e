"""Which release of OpenSim has which class and property first, read from the tags of a clone of opensim-core.

``python schemas/history.py CLONE osimlite/lint/history.json``. Of each release the registrations
and the declarations of classes and properties are read from the text of its sources. What the first
release has that is looked at, and what the text does not tell (instances of templates, for one),
counts as having been there always.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

RELEASES = ("4.0", "4.1", "4.2", "4.3", "v4.3.1", "4.4", "4.4.1", "4.5", "4.5.1", "4.5.2", "4.6")
SAME_IN_FILES = {"path"}
"""Properties that older releases find in a file all the same: by the class of the object, which is its tag."""

REMARK = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
DECLARED = re.compile(
    r"OpenSim_DECLARE_(?:CONCRETE|ABSTRACT)_OBJECT(?:_T)?\s*\(\s*(?P<cls>[\w:]+)\s*,(?:[^,)]*,)?\s*(?P<base>[\w:]+)"
    r"|OpenSim_DECLARE_(?P<kind>\w*(?:PROPERTY|SOCKET|INPUT)\w*)\s*\(\s*(?P<name>[\w:<>]+)\s*,"
)
OLD = re.compile(r"_\w+\.setName\(\s*\"(\w+)\"")
REGISTERED = re.compile(r"[rR]egisterType\s*\(\s*([\w:<>]+)\s*[({]")
FORMAT = re.compile(r"LatestVersion = (\d+);")


class Release(NamedTuple):
    """What the sources of one release say; names are without those of the classes around them."""

    format: int
    bases: dict[str, str]
    properties: dict[str, set[str]]
    registered: set[str]

    def all_properties(self, cls: str) -> set[str]:
        """The properties of a class and of those it derives from."""
        found: set[str] = set()
        seen: set[str] = set()
        while cls and cls not in seen:
            seen.add(cls)
            found |= self.properties.get(cls, set())
            cls = self.bases.get(cls, "")
        return found


def sources(clone: Path, tag: str) -> Iterator[tuple[str, str]]:
    """Read the source files of a release, without tests.

    Yields:
        Name and text of each file.
    """
    listing = subprocess.run(
        ["git", "-C", clone, "ls-tree", "-r", "--name-only", tag, "OpenSim"],
        capture_output=True,
        text=True,
        check=True,
    )
    names = [name for name in listing.stdout.splitlines() if re.search(r"\.(h|cpp)$", name)]
    names = [name for name in names if not re.search(r"/[tT]est|Sandbox", name)]
    wanted = "".join(f"{tag}:{name}\n" for name in names).encode()
    content = subprocess.run(
        ["git", "-C", clone, "cat-file", "--batch"], input=wanted, capture_output=True, check=True
    )
    place = 0
    for name in names:
        head, _, _ = content.stdout[place : place + 200].partition(b"\n")
        start = place + len(head) + 1
        place = start + int(head.split()[-1]) + 1
        yield name, REMARK.sub("", content.stdout[start : place - 1].decode("utf-8", "replace"))


def last(name: str) -> str:
    """A name without those of what it is in."""
    return name.rpartition("::")[2]


def release(clone: Path, tag: str) -> Release:
    """What the sources of a release say."""
    found = Release(0, {}, {}, set())
    for name, text in sources(clone, tag):
        found.properties.setdefault(Path(name).stem, set()).update(OLD.findall(text))
        found.registered.update(
            map(last, REGISTERED.findall(text)) if name.endswith(".cpp") else ()
        )
        if name.endswith("Common/XMLDocument.cpp"):
            found = found._replace(format=int(FORMAT.search(text)[1]))  # type: ignore[index]
        cls = ""
        for match in DECLARED.finditer(text) if name.endswith(".h") else ():
            if match["cls"]:
                cls = last(match["cls"])
                found.bases[cls] = last(match["base"])
            elif cls:
                prefix = next((word for word in ("SOCKET", "INPUT") if word in match["kind"]), "")
                tag_of = f"{prefix.lower()}_{match['name']}" if prefix else match["name"]
                found.properties.setdefault(cls, set()).add(last(tag_of))
    return found


def main() -> None:
    """Write the table."""
    clone = Path(sys.argv[1])
    catalogue = json.loads((Path(__file__).parent / "opensim-4.6.json").read_text())["classes"]
    releases = {tag.removeprefix("v"): release(clone, tag) for tag in RELEASES}
    names = list(releases)
    classes: dict[str, str] = {}
    found: dict[tuple[str, str], dict[str, list[str]]] = {}
    for name, entry in sorted(catalogue.items()):
        known = [version for version in names if last(name) in releases[version].registered]
        if not known or entry["abstract"]:
            continue
        if known[0] != names[0]:
            classes[name] = known[0]
        for row in entry["properties"]:
            tags = {last(row["name"]), last(row.get("accepts_base", row["name"]))}
            has = [
                version for version in names if tags & releases[version].all_properties(last(name))
            ]
            if not has or known[0] == names[-1] or row["name"] in SAME_IN_FILES:
                continue
            told: list[str] = []
            if names.index(has[0]) > names.index(known[0]):
                before, now = (
                    releases[names[names.index(has[0]) - k]].all_properties(last(name))
                    for k in (1, 0)
                )
                gone = sorted(before - now) if len(now - before) == 1 else []
                told = [has[0], *gone[:1]]
            if told or has[0] == names[0]:
                found.setdefault((row["declared_in"], row["name"]), {})[name] = told
    properties: dict[str, list[str]] = {}
    for (declaring, tag), told_by_class in found.items():
        alike = len({tuple(told) for told in told_by_class.values()}) == 1
        for name, told in told_by_class.items():
            if told:
                properties[f"{declaring if alike else name}.{tag}"] = told
    formats = {version: found.format for version, found in releases.items()}
    told = {"formats": formats, "classes": classes, "properties": dict(sorted(properties.items()))}
    Path(sys.argv[2]).write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
