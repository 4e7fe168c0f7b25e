"""Models and records for the tests of translations."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np

from osimlite.schema.joints import WeldJoint
from osimlite.schema.model import Model
from osimlite.translate.export import Urdf
from osimlite.translate.survey import CONTAINERS
from tests.simple_models import make_single_body


def kinds(urdf: Urdf) -> dict[str, list[str]]:
    """Return the components of all records by kind of record."""
    result: dict[str, list[str]] = {}
    for record in urdf.fidelity:
        result.setdefault(record.kind, []).append(record.component)
    return result


def unaccounted(model: Model, urdf: Urdf) -> list[str]:
    paths = [
        component.path for component in model.components() if not isinstance(component, CONTAINERS)
    ]
    return urdf.fidelity.list_missing(paths)


def one_body(*shapes, joint=None, **body) -> Model:
    """Return a model of one body with these shapes, on a weld joint by default."""
    joint = joint or WeldJoint(name="weld")
    model = make_single_body(joint, name="one", body="block", mass=2.0, at=(0.0, 1.0, 0.0), **body)
    model["/bodyset/block"].attach(*shapes)
    return model


def visuals(urdf: Urdf, link: str = "block"):
    return ElementTree.fromstring(urdf.text).findall(f"link[@name='{link}']/visual")


def vertices(content: bytes):
    lines = [line.split() for line in content.decode().splitlines()]
    return np.array([[float(word) for word in line[1:]] for line in lines if line[0] == "v"])
