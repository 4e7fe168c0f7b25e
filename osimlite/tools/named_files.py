"""The files that a setup names, with those that the documents named in it name."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from osimlite.lint.config import Config
from osimlite.lint.engine import subject_of
from osimlite.lint.setup import Setup


def named_files(setup: str, rule: str, passed: frozenset[str] = frozenset()) -> Iterator[str]:
    """Files that a setup, and the documents that it names, names by a rule of names: ``file``, ``output-file``."""
    subject = subject_of(setup, Config())
    if not isinstance(subject, Setup):
        return
    for item in subject.named_files(rule):
        if rule == "file":
            yield item.path
        else:
            folder = os.path.dirname(setup)
            yield os.path.join(folder, item.name.strip())
            yield os.path.join(folder, str(getattr(subject.top, "results_directory", "")).strip(), item.name.strip())
    for item in subject.named_files("file"):
        if item.path.lower().endswith(".xml") and item.path not in passed and os.path.isfile(item.path):
            yield from named_files(item.path, rule, passed | {setup})


def inputs_among(paths: Iterable[Path], setup: Path) -> list[Path]:
    """Those of some files that are a setup or one that it takes something from, by whatever name or link."""
    there = [path for path in paths if os.path.isfile(path)]
    names = (str(setup), *named_files(str(setup), "file")) if there else ()
    inputs = [name for name in dict.fromkeys(names) if os.path.isfile(name)]
    return [path for path in there if any(os.path.samefile(path, name) for name in inputs)]
