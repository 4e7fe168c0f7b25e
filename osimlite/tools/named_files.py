"""Files that a setup names, directly or through the documents that it names."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from osimlite.errors import DocumentError
from osimlite.io.document.cache import cache_by_file
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.engine import load_subject
from osimlite.lint.setup import Setup
from osimlite.schema.tree import is_a

MAX_DOCUMENTS = 500
"""Largest number of documents that one setup may name, directly or through others.

Real setups name about ten.
"""


@cache_by_file(64)
def read_subject(path: str) -> CheckTarget:
    """Return a document as the linter reads it; cached until its file changes.

    Use only the names of files in it: findings depend on other files too.
    """
    return load_subject(path, Config())


def find_named_files(setup: str, rule: str) -> Iterator[str]:
    """Yield the files that a setup names, directly or through the documents that it names.

    Each document is read once. Otherwise setups that name each other would be read again along
    every path between them.

    Args:
        setup: path of the document.
        rule: ``file`` for inputs, ``output-file`` for results.

    Raises:
        DocumentError: the setup names more than `MAX_DOCUMENTS` documents.
    """
    visited = {os.path.realpath(setup)}
    waiting = deque([setup])
    while waiting:
        file = waiting.popleft()
        subject = read_subject(file)
        if subject is None:
            # This raises the error for a missing file.
            subject = load_subject(file, Config())
        if not isinstance(subject, Setup):
            continue
        for naming in subject.find_named_files(rule):
            if rule == "file":
                yield naming.path
            else:
                folder = os.path.dirname(file)
                results = str(getattr(subject.top, "results_directory", "")).strip()
                # Which of the two folders a tool uses depends on the property.
                yield os.path.join(folder, naming.name.strip())
                yield os.path.join(folder, results, naming.name.strip())
        for naming in subject.find_named_files("file"):
            real = os.path.realpath(naming.path)
            if (
                naming.path.lower().endswith(".xml")
                and real not in visited
                and os.path.isfile(real)
            ):
                visited.add(real)
                limit_documents(visited, setup)
                waiting.append(naming.path)


_PREFIXED_RESULT = (
    r"(?:states|states_degrees|controls|pErr|avgResiduals|(?:Kinematics|Actuation)_\w+)\.\w+"
)
"""Ends of the names of results that tools call by their own names."""


def find_prefixed_results(setup: str) -> tuple[str, re.Pattern[str]] | None:
    """Return where a tool writes results whose names follow from its own, such as `so_Kinematics_q.sto`.

    Args:
        setup: path of the setup.

    Returns:
        Real path of the folder and the pattern of the names; None if the document is no tool.
    """
    subject = read_subject(setup)
    top: Any = subject.top if isinstance(subject, Setup) else None
    if not is_a(top, "AbstractTool"):
        return None
    results = str(getattr(top, "results_directory", "")).strip()
    folder = os.path.realpath(os.path.join(os.path.dirname(setup), results))
    analyses = getattr(getattr(top, "analysis_set", None), "objects", ())
    ends = [_PREFIXED_RESULT, *(f"{re.escape(analysis.name)}_.*" for analysis in analyses)]
    return folder, re.compile(f"{re.escape(top.name)}_(?:{'|'.join(ends)})")


def limit_documents(documents: set[str], setup: str) -> None:
    """Raise an error if a setup names too many documents.

    Args:
        documents: paths of the documents.
        setup: path of the setup.

    Raises:
        DocumentError: there are more than `MAX_DOCUMENTS`.
    """
    if len(documents) > MAX_DOCUMENTS:
        message = f"the setup names more than {MAX_DOCUMENTS} documents, directly or through others"
        raise DocumentError(message, file=setup)


def find_inputs(paths: Iterable[Path], setup: Path) -> list[Path]:
    """Return the paths, out of some paths, that lead to a setup or to one of its inputs.

    Args:
        paths: files to compare, by any name or link.
        setup: path of the setup.
    """
    existing = [path for path in paths if os.path.isfile(path)]
    names = (str(setup), *find_named_files(str(setup), "file")) if existing else ()
    inputs = [name for name in dict.fromkeys(names) if os.path.isfile(name)]
    return [path for path in existing if any(os.path.samefile(path, name) for name in inputs)]
