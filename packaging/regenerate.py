"""Write all files of the repository that are generated from the code.

    python packaging/regenerate.py            write those that differ, and name them
    python packaging/regenerate.py --check    write nothing; exit code 1 if one differs
    python packaging/regenerate.py --list     also name what other commands make

Run it after a change of a rule, a class, or an import between rooms. It needs the packages of the extra `dev`.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
if str(ROOT) not in sys.path:
    # The working copy that this script belongs to, whichever is installed.
    sys.path.insert(0, str(ROOT))


def make_rules_page() -> str:
    """Return the index of all rules and thresholds."""
    from osimlite.lint.pages import format_index

    return format_index()


def make_json_schema() -> str:
    """Return the JSON Schema of models as plain data."""
    from osimlite.schema.json_schema import make_json_schema

    return json.dumps(make_json_schema(), indent=1) + "\n"


def make_architecture_picture() -> str:
    """Return the picture of the rooms and their imports."""
    from docs._architecture import make_picture

    return make_picture()


GENERATED: dict[str, Callable[[], str]] = {
    "docs/rules.md": make_rules_page,
    "schemas/osim-4.6.schema.json": make_json_schema,
    "docs/images/architecture.svg": make_architecture_picture,
}
"""By path what makes the text of each file."""

OTHERS = {
    "benchmarks/cost.json": "python benchmarks/cost.py --accept, if a feature is worth what it costs",
    "osimlite/native/": "python packaging/kernel_library.py library (45 s; not in git)",
    "pages on commands, components and rules, llms.txt": "mkdocs build (not in git)",
    "docs/gallery/": "python docs/_gallery.py, after a change of what the pictures show",
    "osimlite/lint/history.json": "python schemas/history.py CLONE osimlite/lint/history.json, after a release of OpenSim",
    "osimlite/view/web/three.js": "the commands in osimlite/view/web/three.entry.js, for a new three.js",
    "docs/images/integrators.png": "python benchmarks/integrators.py",
    "docs/images/walk-precision.png": "python benchmarks/walk_precision.py",
    "docs/images/muscles-of-gait.png": "python benchmarks/muscles_of_gait.py",
    "other pictures in docs/images/": "the commands on the page that shows them",
    "schemas/opensim-4.6.json, schemas/references.json": "facts about OpenSim 4.6, recorded once",
    "osimlite/io/document/generated_comments.bin": "digests of the comments that OpenSim prints, recorded once",
}
"""What this script does not make, and what does."""


def find_stale(root: Path = ROOT) -> dict[str, str]:
    """Return the generated texts that differ from the files in a working copy, by path."""
    stale = {}
    for name, make in GENERATED.items():
        text, path = make(), root / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale[name] = text
    return stale


def main(arguments: list[str] | None = None, root: Path = ROOT) -> int:
    """Run the script.

    Args:
        arguments: of the command line; those of the process if None.
        root: the working copy whose files are compared and written.

    Returns:
        The exit code.
    """
    parser = argparse.ArgumentParser(
        description="Write all files of the repository that are generated from the code."
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing; exit code 1 if a file differs"
    )
    parser.add_argument(
        "--list", action="store_true", help="list all generated files and what makes them"
    )
    options = parser.parse_args(arguments)
    if options.list:
        for name, command in {**dict.fromkeys(GENERATED, "this script"), **OTHERS}.items():
            print(f"{name}: {command}")
        return 0
    stale = find_stale(root)
    for name, text in stale.items():
        if options.check:
            print(f"{name} is not current; run: python packaging/regenerate.py")
        else:
            (root / name).write_text(text, encoding="utf-8")
            print(f"wrote {name}")
    if not stale:
        print("all generated files are current")
    return 1 if options.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
