"""What of a text the measures of a model depend on: a part for each path, and one for all that the paths move with.

What was measured is kept by these parts, in memory and, where findings are kept, beside them: a
path is measured again when its own element has changed, and all of them when anything else has but
for what no path depends on.
"""

from __future__ import annotations

from collections import OrderedDict
from hashlib import blake2b
from typing import TYPE_CHECKING, NamedTuple

from osimlite.base.files import read_file
from osimlite.base.pruning import mark_used
from osimlite.base.writing import write_cached
from osimlite.errors import OsimliteError
from osimlite.lint.measures import Measures, of_owners
from osimlite.schema.specs import lineage

if TYPE_CHECKING:
    from pathlib import Path

    from osimlite.lint.subject import Subject

KEPT = 16
"""So many models are remembered."""

_ASIDE = {"Geometry", "Marker", "Controller", "Probe", "ContactGeometry"}
"""Classes of what no path depends on."""


class Parts(NamedTuple):
    """Digests of the parts of a text."""

    rest: str  # of all that paths move with
    paths: dict[str, str]  # of the element of each path's owner, by its path


class Known(NamedTuple):
    """What was measured, and of which elements by the paths of their owners."""

    paths: dict[str, str]
    measures: Measures

    def of(self, parts: Parts) -> Measures:
        """What still holds of it: of the paths that are as they were."""
        return of_owners(
            self.measures,
            {path for path, own in self.paths.items() if parts.paths.get(path) == own},
        )


remembered: OrderedDict[str, Known] = OrderedDict()


def parts_of(subject: Subject) -> Parts | None:
    """The parts of a text; None of what is no text, or does not stand in one file alone."""
    source = subject.source
    if (
        source is None
        or not source.well_formed
        or subject.config.classes
        or subject.notes_of("include")
    ):
        return None
    places: list[tuple[int, int, str]] = []
    for cls, items in subject.by_class.items():
        has_path = "geometry_path" in cls.model_fields
        if not has_path and _ASIDE.isdisjoint(lineage(cls)):
            continue
        for item in items:
            if item._index is not None:
                span = source.spans[item._index]
                places.append((span.start, span.end, subject.path(item) if has_path else ""))
            elif has_path:
                return None
    rest, paths, seen = blake2b(str(subject.version).encode(), digest_size=16), dict[str, str](), 0
    for start, end, path in sorted(places):
        if start >= seen:
            # Space around an element says nothing, so that one more does not change what is around
            # it.
            rest.update(source.text[seen:start].strip().encode("utf-8", "replace"))
            seen = end
        if path:
            paths[path] = blake2b(
                source.text[start:end].encode("utf-8", "replace"), digest_size=16
            ).hexdigest()
    rest.update(source.text[seen:].strip().encode("utf-8", "replace"))
    return Parts(rest.hexdigest(), paths)


def recall(parts: Parts, folder: Path | None) -> Known | None:
    """What was measured of a model with these parts, but perhaps for those of some paths.

    Args:
        parts: of the text.
        folder: where it may be kept.
    """
    known = remembered.get(parts.rest)
    if known is None and folder is not None:
        from pydantic import TypeAdapter, ValidationError

        try:
            known = TypeAdapter(Known).validate_json(read_file(_file(folder, parts)), strict=True)
        except (OsimliteError, ValidationError):
            return None
        mark_used(_file(folder, parts))
        remembered[parts.rest] = known
    return known


def remember(parts: Parts, measures: Measures, folder: Path | None) -> None:
    """Keep what was measured.

    Args:
        parts: of the text.
        measures: of its model.
        folder: where it is kept; in memory alone if None.
    """
    known = remembered[parts.rest] = Known(parts.paths, measures)
    remembered.move_to_end(parts.rest)
    while len(remembered) > KEPT:
        remembered.popitem(last=False)
    if folder is not None:
        from pydantic import ConfigDict, TypeAdapter

        adapter = TypeAdapter(Known, config=ConfigDict(ser_json_inf_nan="constants"))
        write_cached(_file(folder, parts), adapter.dump_json(known))


def _file(folder: Path, parts: Parts) -> Path:
    return folder / "measured" / f"{parts.rest}.json"
