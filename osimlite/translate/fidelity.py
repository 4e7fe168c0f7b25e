"""Account of a translation: what each component became, and what the target format cannot express."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Literal

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_json
from osimlite.mechanics.multibody.spatial import Array

LEFT_OUT = "left out"
"""Beginning of `Record.done` if nothing of the component is in the target."""


class Error(NamedTuple):
    """Error of an approximation over the poses that were compared.

    Attributes:
        max: largest absolute error.
        rms: root mean square error.
        unit: unit of both.
    """

    max: float
    rms: float
    unit: str

    @classmethod
    def measure(cls, differences: Sequence[float] | Array, unit: str) -> Error:
        """Return the error of some differences.

        Args:
            differences: differences between target and model (k,).
            unit: unit of the differences.
        """
        magnitudes = np.abs(differences).ravel().tolist()
        # Unlike the mean of squares, hypot() does not overflow.
        return cls(max(magnitudes), math.hypot(*magnitudes) / math.sqrt(len(magnitudes)), unit)


@dataclass(frozen=True, slots=True)
class Record:
    """Loss or approximation of one component.

    Attributes:
        kind: subject of the record in one word: force, contact-geometry, coordinate-range, gravity
            ...
        component: absolute path in the model.
        cannot_say: property that the target cannot express, as a phrase.
        done: replacement in the target, as a phrase.
        detail: numbers and names of this case, or "".
        errors: errors of an approximation by quantity: length, value, force ...
    """

    kind: str
    component: str
    cannot_say: str
    done: str
    detail: str = ""
    errors: Mapping[str, Error] = field(default_factory=dict)

    @property
    def how(self) -> Literal["approximate", "dropped"]:
        """Consequence: "dropped" if nothing is in the target, else "approximate"."""
        return "dropped" if self.done.startswith(LEFT_OUT) else "approximate"


@dataclass(frozen=True, slots=True)
class RecordGroup:
    """Records of one kind that say the same about several components.

    Attributes:
        kind: subject of the records in one word.
        cannot_say: property that the target cannot express, as a phrase.
        done: replacement in the target, as a phrase.
        records: records, in the order of the model.
    """

    kind: str
    cannot_say: str
    done: str
    records: tuple[Record, ...]

    @property
    def components(self) -> tuple[str, ...]:
        """Absolute paths of the components.

        Returns:
            One path per record.
        """
        return tuple(record.component for record in self.records)

    def worst(self) -> list[tuple[str, Error]]:
        """Return the largest error of each quantity and unit, over all components and coordinates."""
        result: dict[tuple[str, str], Error] = {}
        for record in self.records:
            for quantity, error in record.errors.items():
                # Moment arms about different coordinates are one quantity for a summary.
                name = quantity.partition(" about ")[0]
                # Tuples are compared by their first entry, the largest error.
                result[name, error.unit] = max(error, result.get((name, error.unit), error))
        return [(name, error) for (name, _), error in result.items()]


@dataclass
class Fidelity:
    """Account of a translation: each component of the model is in `translated` or in a record.

    Components below a component with a record are covered by it and may have none of their own.
    Containers (the sets) and the axes that viewers draw at a frame are not counted.

    Attributes:
        model: name of the model.
        target: target format, for example "urdf".
        translated: element of the target for each component, by absolute path: "link Pelvis",
            "joint RHip_rz".
        records: losses and approximations.
        renamed: new names by path and kind of element, where they differ from those of the
            components.
    """

    model: str
    target: str
    translated: dict[str, str] = field(default_factory=dict)
    records: list[Record] = field(default_factory=list)
    renamed: dict[str, dict[str, str]] = field(default_factory=dict)

    def __iter__(self) -> Iterator[Record]:
        return iter(self.records)

    def __len__(self) -> int:
        return len(self.records)

    def add(
        self,
        kind: str,
        component: str,
        cannot_say: str,
        done: str,
        detail: str = "",
        errors: Mapping[str, Error] | None = None,
    ) -> None:
        """Add a record of a loss or an approximation.

        Args:
            kind: subject of the record in one word.
            component: absolute path in the model.
            cannot_say: property that the target cannot express, as a phrase.
            done: replacement in the target, as a phrase.
            detail: numbers and names of this case.
            errors: errors of the approximation by quantity.
        """
        self.records.append(Record(kind, component, cannot_say, done, detail, errors or {}))

    def note_name(self, component: str, kind: str, component_name: str, name: str) -> None:
        """Note the new name of an element if it differs from the name of its component.

        Args:
            component: absolute path in the model.
            kind: kind of element, for example "joint".
            component_name: name of the component.
            name: name of the element.
        """
        # Only new names are worth an entry.
        if name != component_name:
            self.renamed.setdefault(component, {})[kind] = name

    def groups(self) -> list[RecordGroup]:
        """Return the records in groups that say the same, in the order of their first records."""
        result: dict[tuple[str, str, str], list[Record]] = {}
        for record in self.records:
            result.setdefault((record.kind, record.cannot_say, record.done), []).append(record)
        return [RecordGroup(*key, tuple(records)) for key, records in result.items()]

    def counts(self) -> tuple[int, int, int]:
        """Count the components by outcome.

        Returns:
            Numbers of components that are translated exactly, approximately, and not at all.
        """
        # A component with several records counts once, by the worst of them.
        dropped_paths = {record.component for record in self.records if record.how == "dropped"}
        changed_paths = {record.component for record in self.records} - dropped_paths
        return (
            len(self.translated.keys() - changed_paths - dropped_paths),
            len(changed_paths),
            len(dropped_paths),
        )

    def list_missing(self, paths: Iterable[str]) -> list[str]:
        """Return the paths that the account does not cover.

        They are neither translated nor recorded, nor below a record.
        """
        # A record covers all components below it.
        recorded = {record.component for record in self.records}
        missing = []
        for path in paths:
            path_parts = path.split("/")
            # Paths begin with a slash, so that the first part is empty.
            ancestors = {
                "/".join(path_parts[:count]) for count in range(2, len(path_parts) + 1)
            } | {path}
            if path not in self.translated and not ancestors & recorded:
                missing.append(path)
        return missing

    def to_json(self) -> str:
        """Return the account as JSON text."""
        records = [
            {
                "kind": record.kind,
                "how": record.how,
                "component": record.component,
                "cannot_say": record.cannot_say,
                "done": record.done,
                **({"detail": record.detail} if record.detail else {}),
                **(
                    {"errors": {name: error._asdict() for name, error in record.errors.items()}}
                    if record.errors
                    else {}
                ),
            }
            for record in self.records
        ]
        content = {
            "model": self.model,
            "target": self.target,
            "records": records,
            "translated": self.translated,
        }
        return format_json({**content, "renamed": self.renamed} if self.renamed else content)
