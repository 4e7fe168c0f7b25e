"""The account of a translation: what became what, and what the target cannot say."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.base.text import format_json
from osimlite.mechanics.multibody.spatial import Array

LEFT_OUT = "left out"
"""What `Record.done` starts with where nothing of the component is in the target."""


class Error(NamedTuple):
    """How far the target is from the model over the poses that were compared: the worst, and the root mean square."""

    max: float
    rms: float
    unit: str

    @classmethod
    def measure(cls, differences: Sequence[float] | Array, unit: str) -> Error:
        """The error that these differences are."""
        off = np.abs(differences)
        return cls(float(off.max()), float(np.sqrt(np.mean(off**2))), unit)


@dataclass(frozen=True, slots=True)
class Record:
    """One thing that the target cannot say."""

    kind: str  # a word for what it concerns: force, contact-geometry, coordinate-range, gravity ...
    component: str  # absolute path in the model
    cannot_say: str  # what the target cannot say
    done: str  # what was done about it
    detail: str = ""  # the numbers and names of this case; may be empty
    # what was measured of an approximation, by the name of the quantity: length, value, force ...
    errors: Mapping[str, Error] = field(default_factory=dict)

    @property
    def how(self) -> Literal["approximate", "dropped"]:
        """Whether something of it is left."""
        return "dropped" if self.done.startswith(LEFT_OUT) else "approximate"


@dataclass(frozen=True, slots=True)
class Group:
    """Records that say the same of several components."""

    kind: str
    cannot_say: str
    done: str
    records: tuple[Record, ...]

    @property
    def components(self) -> tuple[str, ...]:
        """Absolute paths of the components."""
        return tuple(record.component for record in self.records)

    def worst(self) -> list[tuple[str, Error]]:
        """The largest error of each quantity and unit, whatever it is about."""
        result: dict[tuple[str, str], Error] = {}
        for record in self.records:
            for what, error in record.errors.items():
                name = what.partition(" about ")[0]
                result[name, error.unit] = max(error, result.get((name, error.unit), error))
        return [(name, error) for (name, _), error in result.items()]


@dataclass
class Fidelity:
    """Everything a translation has to answer for: each component of the model is in `translated` or in a record.

    What stands below a component that has a record shares its fate and may have none of its own;
    containers (the sets) and the axes that viewers draw at a frame are not counted.

    Attributes:
        model: name of the model.
        target: the format, e.g. ``"urdf"``.
        translated: what became of a component, by absolute path: ``"link Pelvis"``, ``"joint
            RHip_rz"``.
        records: what the target cannot say.
        renamed: the names of what a component became, by its path and by kind, where they are not
            its own.
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
        """Add a record."""
        self.records.append(Record(kind, component, cannot_say, done, detail, errors or {}))

    def note_name(self, component: str, kind: str, own: str, name: str) -> None:
        """Take note of what a thing is called that a component became, if that is not the component's own name."""
        if name != own:
            self.renamed.setdefault(component, {})[kind] = name

    def groups(self) -> list[Group]:
        """The records, those of one kind that say the same together, in the order of the first of each."""
        result: dict[tuple[str, str, str], list[Record]] = {}
        for record in self.records:
            result.setdefault((record.kind, record.cannot_say, record.done), []).append(record)
        return [Group(*key, tuple(records)) for key, records in result.items()]

    def counts(self) -> tuple[int, int, int]:
        """How many components are in the target as they are, in another way, and not at all."""
        dropped = {record.component for record in self.records if record.how == "dropped"}
        changed = {record.component for record in self.records} - dropped
        return len(self.translated.keys() - changed - dropped), len(changed), len(dropped)

    def list_missing(self, paths: Iterable[str]) -> list[str]:
        """Those of the paths that nothing accounts for: neither translated nor recorded, nor below a record."""
        recorded = {record.component for record in self.records}
        missing = []
        for path in paths:
            parts = path.split("/")
            above = {"/".join(parts[:count]) for count in range(2, len(parts) + 1)} | {path}
            if path not in self.translated and not above & recorded:
                missing.append(path)
        return missing

    def to_json(self) -> str:
        """The account as JSON text."""
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
