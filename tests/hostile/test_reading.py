"""Check that every file named by a user or a document is opened by `osimlite.base.reading`."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "osimlite"

METHODS = {
    "read_text",
    "read_bytes",
    "open",
    "fdopen",
    "fromfile",
    "memmap",
    "loadtxt",
    "genfromtxt",
    "iterparse",
}
"""Names of methods and functions that open a file, whatever object or module has them."""

OF_MODULES = {
    "np": {"load"},
    "numpy": {"load"},
    "etree": {"parse"},
    "ElementTree": {"parse"},
    "tomllib": {"load"},
    "json": {"load"},
    "yaml": {"load"},
    "pickle": {"load"},
    "zipfile": {"ZipFile"},
    "tarfile": {"TarFile"},
}
"""Functions of certain modules that open or read a file."""

OTHERS = {"webbrowser", "document"}
"""Objects and modules whose method `open` does not open a file."""

ALLOWED = {
    "base/reading.py": "the module that opens files",
    "base/writing.py": "opens what it writes, and the file that it wrote before",
    "studies/sweep/results.py": "opens what it writes",
    "simulation/engines/private_files.py": "files that only the user can have written, checked by their owner",
    "simulation/engines/bullet/world.py": "the null device, for output",
    "simulation/engines/compiled_laws.py": "a library that it has compiled, and its own sources",
    "simulation/engines/kernel_library.py": "its own sources",
    "io/tables/c3d.py": "bytes in memory, from a process of its own",
    "mechanics/codegen/processor.py": "the list of processors of Linux, at most 8192 characters",
    "mechanics/codegen/cplusplus/library.py": "a header of the package",
    "io/document/xml_text.py": "data of the package",
    "lint/history.py": "data of the package",
    "models/walking/__init__.py": "data of the package",
    "view/page.py": "data of the package",
    "cli/_exiting.py": "the null device, for output",
    "cli/demo.py": "data of the package, and the model that it has written",
    "base/pruning.py": "folders of the cache, without links",
}
"""Modules of the package that open files in another way, and why they may."""


_CALLED = "|".join({"open", *METHODS, *(name for names in OF_MODULES.values() for name in names)})
_ANY_CALL = re.compile(rf"\b(?:{_CALLED})\s*\(")
"""Pattern that every source with such a call contains; most sources need not be parsed."""


def find_reads(text: str) -> Iterator[tuple[int, str]]:
    """Yield line and name of each call in a source that may open a file."""
    if not _ANY_CALL.search(text):
        return
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        match node.func:
            case ast.Name(id="open"):
                yield node.lineno, "open"
            case ast.Attribute(value=ast.Name(id=owner), attr=name) if name in OF_MODULES.get(
                owner, ()
            ):
                yield node.lineno, f"{owner}.{name}"
            case ast.Attribute(value=ast.Name(id=owner)) if owner in OTHERS:
                continue
            case ast.Attribute(attr=name) if name in METHODS:
                yield node.lineno, name


def test_no_other_module_opens_files():
    reads = {
        path.relative_to(PACKAGE).as_posix(): [*find_reads(path.read_text(encoding="utf-8"))]
        for path in sorted(PACKAGE.rglob("*.py"))
    }
    wrong = [
        f"{name}:{line}: {call}"
        for name, calls in reads.items()
        if name not in ALLOWED
        for line, call in calls
    ]
    assert not wrong, "open these by osimlite.base.reading or osimlite.base.files:\n" + "\n".join(
        wrong
    )
    assert not [name for name in ALLOWED if not reads.get(name)], "a module opens nothing any more"


def test_the_search_knows_each_way_to_open_a_file():
    ways = (
        "open(p)",
        "p.open()",
        "Path(p).read_text()",
        "p.read_bytes()",
        "np.load(p)",
        "etree.parse(p)",
        "os.open(p, 0)",
    )
    for way in ways:
        assert [*find_reads(way)], way
    for other in ("webbrowser.open(p)", "parse(p)", "open_file(p)", "json.loads(p)"):
        assert not [*find_reads(other)], other
