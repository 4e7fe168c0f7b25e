"""Check for every class that OpenSim reads osimlite's output and prints the same text.

Every property of the class is set.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import osimlite
from osimlite.schema.base import Component, Object
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.model import Model
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import get_field_specs
from tests.oracle.support import COMMENT_LINE
from tests.schema.support import UNREGISTERED

pytestmark = pytest.mark.oracle
opensim = pytest.importorskip("opensim")


KNOWN = [(tag, find_class(tag) or Object) for tag in list_tags()]
COMPONENTS = [
    tag for tag, cls in KNOWN if tag != "Model" and issubclass(cls, Component) and not cls.since
]
OTHERS = [tag for tag, cls in KNOWN if not issubclass(cls, Component) and not cls.since]


def filled(cls: type[Object]) -> Object:
    """Return an instance with a different value in every text and number; owned objects keep their defaults."""
    values: dict[str, Any] = {"name": "filled"}
    for number, spec in enumerate(get_field_specs(cls).values()):
        kind = spec.kind
        if isinstance(kind, Reference):
            values[spec.name] = ("one", "two") if kind.shape == "list" else "one"
        elif isinstance(kind, Value):
            scalars = {
                "double": 1 / (number + 3),
                "int": number + 2,
                "bool": True,
                "string": f"word{number}",
            }
            word: Any = kind.choices[-1] if kind.choices else scalars[kind.scalar]
            if kind.legacy and kind.shape == "list" and kind.scalar == "double":
                word = float(f"{word:g}")  # OpenSim prints six digits of these values
            # OpenSim prints the rotation of a frame from its matrix, not as it was read. Therefore
            # use zeros.
            word = 0.0 if kind.shape == "Transform" else word
            size = kind.size or kind.most or max(kind.least, 2)
            values[spec.name] = word if kind.shape in ("single", "optional") else (word,) * size
        elif isinstance(kind, ObjectField) and kind.form == "list":
            values[spec.name] = []
    return cls(**values)


@pytest.mark.parametrize("tag", COMPONENTS)
def test_opensim_prints_the_same(tag: str, tmp_path: Path) -> None:
    cls = find_class(tag)
    assert cls is not None
    model = Model(name="m")
    component = filled(cls)
    assert isinstance(component, Component)
    model.subcomponents.append(component)
    lines = osimlite.to_text(model, numbers="opensim").splitlines()
    start, end = lines.index("\t\t<components>"), lines.index("\t\t</components>")
    inner = "\n".join(line[2:] for line in lines[start + 1 : end])
    text = f'<?xml version="1.0" encoding="UTF-8" ?>\n<OpenSimDocument Version="40600">\n{inner}\n</OpenSimDocument>\n'
    ours, theirs = tmp_path / "ours.xml", tmp_path / "theirs.xml"
    ours.write_text(text)
    opensim.Logger.setLevelString("off")
    loaded = opensim.OpenSimObject.makeObjectFromFile(str(ours))
    assert loaded is not None
    loaded.printToXML(str(theirs))
    assert COMMENT_LINE.sub("", theirs.read_text()) == text


@pytest.mark.parametrize("tag", OTHERS)
def test_opensim_prints_the_same_document(tag: str, tmp_path: Path) -> None:
    cls = find_class(tag)
    assert cls is not None
    ours, theirs = tmp_path / "ours.xml", tmp_path / "theirs.xml"
    osimlite.write(filled(cls), ours, numbers="opensim")
    opensim.Logger.setLevelString("off")
    loaded = opensim.OpenSimObject.makeObjectFromFile(str(ours))
    if tag in UNREGISTERED:
        assert loaded is None
        return
    loaded.printToXML(str(theirs))
    assert COMMENT_LINE.sub("", theirs.read_text()) == ours.read_text()
    assert osimlite.read_document(theirs) == osimlite.read_document(ours)
