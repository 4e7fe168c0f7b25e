"""What the parts of a study share: where its files are, and how an error says what it is about."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from osimlite.errors import DocumentError, UnsupportedError
from osimlite.schema.base import Object
from osimlite.simulation.files.storage import beside
from osimlite.text import did_you_mean


class Asked:
    """A study or a tool of Moco, by the file that it stands in.

    Args:
        file: it stands in; None if it is in none.
        folder: that the files are in that it names, if it is in none; the current folder if None.
    """

    def __init__(self, file: str | Path | None, folder: Path | None) -> None:
        self.file = None if file is None else Path(file)
        self.folder = self.file.parent if self.file is not None else folder or Path(".")

    def place(self, name: str) -> Path:
        """Where a file is that the study names: looked for from its folder, then from the current one."""
        return beside(self.folder, name.strip())

    def _placed(self, part: Object) -> dict[str, Any]:
        """Where a part of the study stands: objects know no lines, but their tags and names are in the text."""
        if self.file is None:
            return {}
        tags = re.compile(rf"<{re.escape(type(part).tag)}(\s[^>]*)?/?>")
        named = re.compile(rf'name="{re.escape(part.name)}"')
        try:
            lines = self.file.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeError):
            return {"file": str(self.file)}
        found = [(number, text) for number, text in enumerate(lines, 1) if tags.search(text)]
        found = [pair for pair in found if named.search(pair[1])] or found
        return {"file": str(self.file), "line": found[0][0] if found else None}

    def refused(self, part: Object, reason: str) -> UnsupportedError:
        """The error of what is not solved here."""
        name = f" '{part.name}'" if part.name else ""
        return UnsupportedError(f"{type(part).tag}{name}: {reason}", **self._placed(part))

    def wrong(self, part: Object, reason: str) -> DocumentError:
        """The error of what cannot be."""
        name = f" '{part.name}'" if part.name else ""
        return DocumentError(f"{type(part).tag}{name}: {reason}", **self._placed(part))

    def expect(self, part: Object, name: str, known: Iterable[str], what: str) -> None:
        """Refuse a name that is none, with the nearest one that is.

        Raises:
            DocumentError: it is none.
        """
        known = [*known]
        if name not in known:
            raise self.wrong(part, f"the model has no {what} '{name}'{did_you_mean(name, known)}")
