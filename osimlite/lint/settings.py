"""Settings of a project: ``[tool.osimlite]`` of the nearest pyproject.toml, or an osimlite.toml."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Any

from osimlite.base.files import list_mesh_folders
from osimlite.base.project import find_settings, parse_max_file_size
from osimlite.base.records import dataclass, field
from osimlite.base.text import append_clause, join_words, suggest_name
from osimlite.errors import OsimliteError
from osimlite.lint.config import Config, parse_codes
from osimlite.lint.diagnostic import Severity

_SETTINGS = (
    "select", "ignore", "per-file-ignores", "severity", "mesh-paths", "fail-on", "thresholds", "largest-file",
    "classes", "target-version",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of a project. Paths and patterns are relative to the folder of `file`."""

    file: Path | None = None
    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    per_file_ignores: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    severity: Mapping[str, Severity] = field(default_factory=dict)
    mesh_paths: tuple[str, ...] = ()
    fail_on: Severity | None = None
    thresholds: Mapping[str, float] = field(default_factory=dict)
    classes: tuple[str, ...] = ()
    target_version: str = ""

    def config_for(self, path: str | Path, overriding: Config) -> Config:
        """Return the configuration of one file; `overriding` has precedence over the project.

        Args:
            path: path of the file.
            overriding: configuration of the command line.
        """
        return Config(
            # A selection replaces that of the project, whereas codes to ignore add up: the command
            # line cannot run a rule that the project has switched off by accident.
            overriding.select or self.select,
            (*self.ignore, *self._find_ignored_codes(Path(path)), *overriding.ignore),
            {**self.severity, **overriding.severity},
            (*overriding.mesh_paths, *self.mesh_paths, *map(str, list_mesh_folders())),
            {**self.thresholds, **overriding.thresholds},
            (*self.classes, *overriding.classes),
            overriding.target_version or self.target_version,
        )

    def _find_ignored_codes(self, path: Path) -> tuple[str, ...]:
        if not self.per_file_ignores or self.file is None:
            return ()
        try:
            relative = path.resolve().relative_to(self.file.parent.resolve()).as_posix()
        except ValueError:
            # A file outside of the project matches patterns by its name only.
            relative = path.as_posix()
        codes = (
            words
            for pattern, words in self.per_file_ignores.items()
            if fnmatch(relative, pattern) or fnmatch(path.name, pattern)
        )
        return tuple(code for words in codes for code in words)


@cache
def load_settings(folder: Path) -> Settings:
    """Return the settings of a folder: those of the nearest file that has any.

    Raises:
        OsimliteError: the file is not TOML, or has an unknown or invalid setting.
    """
    result = find_settings(folder)
    return Settings() if result is None else _parse_settings(*result)


def _parse_settings(file: Path, table: dict[str, Any]) -> Settings:
    """Return the checked settings of a configuration file.

    Args:
        file: configuration file, for messages and as the start of relative paths.
        table: settings in the file, by key.

    Raises:
        OsimliteError: a setting is unknown or has an invalid value.
    """
    parse_max_file_size(file, table)
    for key in table:
        if key not in _SETTINGS:
            setting_names = join_words(_SETTINGS, max_count=len(_SETTINGS))
            raise OsimliteError(
                append_clause(
                    f"unknown setting '{key}'{suggest_name(key, _SETTINGS)}",
                    f"settings are {setting_names}",
                ),
                file=str(file),
            )
    try:
        ignores = _read_table(table, "per-file-ignores")
        return Settings(
            file,
            parse_codes(_read_texts(table, "select")),
            parse_codes(_read_texts(table, "ignore")),
            {pattern: parse_codes(_read_texts(ignores, pattern)) for pattern in ignores},
            {
                parse_codes([code])[0]: _parse_severity(word)
                for code, word in _read_table(table, "severity").items()
            },
            tuple(str(file.parent.resolve() / path) for path in _read_texts(table, "mesh-paths")),
            _parse_severity(table["fail-on"]) if "fail-on" in table else None,
            Config(thresholds=_read_table(table, "thresholds")).thresholds,
            tuple(str(file.parent.resolve() / path) for path in _read_texts(table, "classes")),
            Config(target_version=str(table.get("target-version", ""))).target_version,
        )
    except OsimliteError as error:
        # The parsers of single values do not know the file, which the user must edit.
        raise OsimliteError(error.message, file=str(file)) from None


def _read_texts(table: dict[str, Any], key: str) -> list[str]:
    value = table.get(key, [])
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise OsimliteError(f"'{key}' must be a list of texts")
    return value


def _read_table(table: dict[str, Any], key: str) -> dict[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise OsimliteError(f"'{key}' must be a table")
    return value


def _parse_severity(word: object) -> Severity:
    if word not in tuple(Severity):
        raise OsimliteError(f"a severity is one of {join_words(Severity)}, not '{word}'")
    return Severity(str(word))
