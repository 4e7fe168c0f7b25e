"""What is checked, by the names of files, and for XML by how it begins."""

from __future__ import annotations

import re
from pathlib import Path

from osimlite.files import model_files

TABLES = (".sto", ".mot", ".trc")
"""Tables over time."""
DOCUMENTS = (".xml", ".omoco")
"""Setups of tools and what they consist of."""
PROJECT = (".osim", *DOCUMENTS, *TABLES)
"""Everything that belongs to a project."""

_OURS = re.compile(rb"<OpenSimDocument\b|<(\w*(Tool|TaskSet|MarkerSet|ExternalLoads|ControlSet|ForceSet|ScaleSet))\b")


def is_table(file: str | None) -> bool:
    """Whether a file is a table, by its name."""
    return file is not None and file.lower().endswith(TABLES)


def is_document(file: str | None) -> bool:
    """Whether a file is a document other than a model, by its name."""
    return file is not None and file.lower().endswith(DOCUMENTS)


def project_files(folder: str | Path) -> list[str]:
    """Every file below a folder that is checked; OsimliteError if there is none."""
    return list(filter(begins_as_ours, map(str, model_files([Path(folder)], PROJECT))))


def begins_as_ours(file: str) -> bool:
    """Whether a file that was not named but found is OpenSim's: other programs write XML too."""
    if not file.lower().endswith(".xml"):
        return True
    try:
        with open(file, "rb") as stream:
            return is_ours(stream.read(4000))
    except OSError:
        return True


def is_ours(beginning: bytes) -> bool:
    """Whether XML that begins so is OpenSim's."""
    return _OURS.search(beginning) is not None
