"""Cache of the reports of files, so that unchanged files need not be checked again.

An entry is valid for one text under one path, one configuration, and one version of osimlite. A
file with the recorded times, size and inode is unchanged; otherwise its checksum decides. A report
may depend on other files that the model names: an entry records when each of them was last written,
or that it was missing.
"""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path
from time import time_ns
from types import NoneType
from typing import TYPE_CHECKING, Any
from zlib import crc32

from osimlite import __version__
from osimlite.base.files import get_file_stamp, read_file
from osimlite.base.pruning import mark_used
from osimlite.base.require import find_missing_packages
from osimlite.base.writing import write_cached
from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Consequence, Edit, Finding, Fix, Report, Severity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from osimlite.lint.config import Config

Stamp = tuple[int, int] | None


class Cache:
    """Folder with a file for each entry; any error means that the entry is missing."""

    def __init__(self, folder: Path) -> None:
        # A new version has other rules, so it starts with an empty folder.
        self.folder = folder / __version__
        self._stamps: dict[str, Stamp] = {}

    def get(self, file: str, key: str) -> Report | None:
        """Return the cached report of a file; None without a valid entry for this key.

        Args:
            file: path of the file.
            key: key of the entry, from `make_key`.
        """
        try:
            # Entries may be damaged or written by another program: each value is checked before it
            # is used.
            match json.loads(read_file(self._get_entry_path(file))):
                case {
                    "key": str(cached_key),
                    "text": [*text],
                    "outside": [*outside_stamps],
                    "findings": [*findings],
                    "unmeasured": [*why_not],
                    **other_fields,
                }:
                    stamps = dict(map(_parse_outside, outside_stamps))
                    if cached_key != key or any(
                        self._get_stamp(path) != stamp for path, stamp in stamps.items()
                    ):
                        return None
                    why_not = _check_types(why_not, *[_TEXT] * len(why_not))
                    report = Report(
                        [_parse_finding(file, values) for values in findings], unmeasured=why_not
                    )
                    now = time_ns()
                    # The stamp differs after a checkout or a copy, though the text may be the same.
                    if other_fields.get("file") != _stamp_file(file):
                        if text != fingerprint_text(read_file(file)):
                            return None
                        # With a new stamp, the next check need not read the text.
                        self.store(file, key, text, report, stamps, now)
                    mark_used(self._get_entry_path(file))
                    return report
        # A damaged entry is no reason to fail: the file is checked again.
        except (OsimliteError, OSError, ValueError, TypeError, RecursionError):
            pass
        return None

    def store(
        self,
        file: str,
        key: str,
        text: list[object],
        report: Report,
        outside_paths: Iterable[str],
        since: int,
    ) -> None:
        """Cache the report of a file.

        Args:
            file: path of the file.
            key: key of the entry, from `make_key`.
            text: fingerprint of the text that was checked, from `fingerprint_text`.
            report: report about the file.
            outside_paths: paths of other files and folders on which the report depends.
            since: time at which the check began, ns.
        """
        cache_path = self._get_entry_path(file)
        try:
            entry = {
                "key": key,
                "file": _stamp_if_old_enough(file, since),
                "text": text,
                "outside": [(path, self._get_stamp(path)) for path in outside_paths],
                "findings": [_dump_finding(finding) for finding in report],
                "unmeasured": report.unmeasured,
            }
        except (OSError, OsimliteError):
            return
        write_cached(cache_path, json.dumps(entry, separators=(",", ":")))

    def _get_entry_path(self, file: str) -> Path:
        # The key contains the path too: of two files with the same checksum, the last one is cached.
        digest = f"{crc32(os.path.abspath(file).encode(errors='surrogateescape')):08x}"
        return self.folder / digest[:2] / f"{digest[2:]}.json"

    def _get_stamp(self, path: str) -> Stamp:
        # Many models share their meshes.
        if path not in self._stamps:
            try:
                result = os.stat(path)
                self._stamps[path] = result.st_mtime_ns, result.st_size
            except (OSError, ValueError):
                self._stamps[path] = None
        return self._stamps[path]


def make_key(file: str, config: Config) -> str:
    """Return a key from all that determines a report: path, configuration, version of the code.

    Args:
        file: path of the file.
        config: configuration of its check.
    """
    # Sorted, since the order of keys in a configuration does not change the report.
    severity = sorted((word, str(level)) for word, level in config.severity.items())
    thresholds = sorted((name, float(number)) for name, number in config.thresholds.items())
    setting = (
        describe_code_version(),
        file,
        os.getcwd(),
        config.select,
        config.ignore,
        severity,
        config.mesh_paths,
        thresholds,
        [(path, get_file_stamp(path)) for path in config.classes],
        config.target_version,
        # Rules that measure are skipped without numpy; installing it changes the report.
        find_missing_packages("numpy"),
    )
    return ascii(setting)


def fingerprint_text(data: bytes) -> list[object]:
    """Return the size and the checksum of a text.

    Returns:
        List of the size in bytes and the CRC-32.
    """
    return [len(data), crc32(data)]


def _stamp_file(file: str) -> list[int]:
    """Return a stamp that changes with a file: its times (ns), its size and its inode."""
    result = os.stat(file)
    return [result.st_mtime_ns, result.st_ctime_ns, result.st_size, result.st_ino]


def _stamp_if_old_enough(file: str, moment: int) -> list[int] | None:
    """Return the stamp of a file; None if it may have changed after a moment (ns), since file clocks tick slowly."""
    # A change within the tick of the file system's clock would leave the time of modification as it
    # was.
    stamp = _stamp_file(file)
    changed = max(stamp[:2])
    # Whole seconds point to a file system such as FAT, which records them in steps of two seconds.
    tick = 100_000_000 if changed % 1_000_000_000 else 2_000_000_000
    return stamp if changed + tick < moment else None


@cache
def describe_code_version() -> str:
    """Return a text that identifies the code: in a working copy the newest modification time counts.

    An installed package changes only as a whole.
    """
    # Only a working copy has pyproject.toml beside the package.
    package = Path(__file__).parents[1]
    if not (package.parent / "pyproject.toml").exists():
        return f"{__version__} {os.stat(__file__).st_mtime_ns}"
    times = []
    for folder, folders, names in os.walk(package):
        folders[:] = [name for name in folders if name != "__pycache__"]
        times += [os.stat(f"{folder}/{name}").st_mtime_ns for name in names if name.endswith(".py")]
    return f"{__version__} {max(times)} {len(times)}"


def _check_types(values: Any, *kinds: tuple[type, ...]) -> Any:
    """Return a list after checking the types of its items.

    A boolean does not count as a number.

    Args:
        values: list from a cache entry.
        kinds: permitted types of each item.

    Raises:
        TypeError: `values` is not a list of this length, or an item has another type.
    """
    if type(values) is not list or len(values) != len(kinds):
        raise TypeError
    if not all(type(value) in kind for value, kind in zip(values, kinds, strict=True)):
        raise TypeError
    return values


_TEXT, _NUMBER, _LIST, _FLAG = (str,), (int,), (list,), (bool,)
_MAYBE_TEXT, _MAYBE_NUMBER, _MAYBE_LIST = (str, NoneType), (int, NoneType), (list, NoneType)
_FINDING = (
    _TEXT, _TEXT, _TEXT, _TEXT, _MAYBE_NUMBER, _MAYBE_NUMBER, _NUMBER, _TEXT, _MAYBE_TEXT, _MAYBE_LIST,
    _MAYBE_TEXT,
)  # fmt: skip


def _parse_outside(values: Any) -> tuple[str, Stamp]:
    """Return a path and its stamp from an entry; TypeError for anything else."""
    path, stamp = _check_types(values, _TEXT, _MAYBE_LIST)
    return path, None if stamp is None else tuple(_check_types(stamp, _NUMBER, _NUMBER))


def _dump_finding(finding: Finding) -> list[object]:
    """Return a finding as a list for JSON, without its file."""
    fix = finding.fix
    return [
        finding.code,
        finding.name,
        finding.severity.value,
        finding.message,
        finding.line,
        finding.column,
        finding.length,
        finding.component,
        finding.suggestion,
        None
        if fix is None
        else [fix.safe, [[edit.start, edit.end, edit.text] for edit in fix.edits]],
        finding.consequence and finding.consequence.value,
    ]


def _parse_finding(file: str, values: Any) -> Finding:
    """Return the finding from a list that `_dump_finding` has made.

    Args:
        file: file of the finding.
        values: list from a cache entry.

    Raises:
        TypeError: the values are not those of a finding.
        ValueError: the severity or the consequence is unknown.
    """
    values = _check_types(values, *_FINDING)
    code, name, severity, message, line, column, length, component, suggestion, fix = values[:-1]
    consequence = values[-1]
    position = [number for number in (line, column) if number is not None]
    # A line without a column, or the other way round, cannot come from a finding; numbers count
    # from 1.
    if len(position) == 1 or min(*position, length, length) < 1:
        raise TypeError
    level = Severity(severity)
    return Finding(
        code,
        name,
        level,
        message,
        file,
        line,
        column,
        length,
        component,
        suggestion,
        _parse_fix(fix),
        None if consequence is None else Consequence(consequence),
    )


def _parse_fix(values: Any) -> Fix | None:
    if values is None:
        return None
    safe, edits = _check_types(values, _FLAG, _LIST)
    return Fix(tuple(Edit(*_check_types(edit, _NUMBER, _NUMBER, _TEXT)) for edit in edits), safe)
