"""Check that every property has a description, in every place where users look for it."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from importlib import import_module
from pathlib import Path

import pytest

import osimlite
from osimlite.schema.base import Object
from osimlite.schema.descriptions import describe_property
from osimlite.schema.json_schema import make_json_schema
from osimlite.schema.registry import MODULES
from osimlite.schema.specs import FieldSpec
from tests.cases import of_each

# Largest number of characters of a description.
LONGEST = 140

CLASSES: list[type[Object]] = [
    cls
    for name, module in MODULES.items()
    if not (cls := getattr(import_module(module), name)).abstract
]
SPECS: dict[str, FieldSpec] = {
    f"{spec.declared_in.__name__}.{spec.name}": spec
    for cls in CLASSES
    for spec in cls.field_specs().values()
}


def test_there_are_properties() -> None:
    assert len(CLASSES) > 150
    assert len(SPECS) > 600


@of_each(SPECS)
def test_every_property_has_a_meaning(key: str) -> None:
    meaning = describe_property(SPECS[key])
    assert len(meaning.split()) >= 2, f"write a line below the declaration of {key}"
    assert len(meaning) <= LONGEST
    assert meaning.endswith(".") and not meaning.endswith("..")
    assert meaning == " ".join(meaning.split()), "one line"


@of_each(CLASSES, lambda cls: cls.tag)
def test_what_is_written_in_ticks_exists(cls: type[Object]) -> None:
    """Words in backticks name properties of the same object, of one of its parts, or of its owner."""
    known = {
        name
        for each in CLASSES
        for spec in each.field_specs().values()
        for name in (spec.tag, spec.name)
    }
    variables = {
        "q",
        "qdot",
        "d",
        "ddot",
        "s",
        "ldot",
        "theta_x",
        "theta_y",
        "theta_z",
        "delta_x",
        "delta_y",
        "delta_z",
    }
    words = {"all", "path|output", "markers", "forces"}
    for spec in cls.field_specs().values():
        ticked = describe_property(spec).split("`")[1::2]
        assert set(ticked) <= known | variables | words, spec.name


def test_an_inherited_property_means_the_same() -> None:
    inherited = osimlite.PinJoint.field_specs()["socket_parent_frame"]
    assert inherited.declared_in is not osimlite.PinJoint
    assert (
        describe_property(inherited)
        == describe_property(osimlite.FreeJoint.field_specs()["socket_parent_frame"])
        != ""
    )


def test_help_says_it() -> None:
    meaning = describe_property(osimlite.Body.field_specs()["inertia"])
    assert meaning in " ".join((osimlite.Body.__doc__ or "").split())


def test_the_json_schema_says_it() -> None:
    properties = make_json_schema()["$defs"]["Body"]["properties"]
    mass = osimlite.Body.field_specs()["mass"]
    assert properties["mass"]["description"] == f"{describe_property(mass)} (kg, >= 0)"
    wraps = osimlite.Body.field_specs()["WrapObjectSet"]
    assert properties["wrap_object_set"]["description"] == describe_property(wraps)


@pytest.mark.parametrize("compiled", [False, True])
def test_in_an_archive(compiled: bool, tmp_path: Path) -> None:
    """Descriptions are found in zipped sources, and are empty if only compiled modules exist."""
    package, archive = Path(osimlite.__file__).parent, tmp_path / "archive.zip"
    if compiled:
        with zipfile.PyZipFile(str(archive), "w") as target:
            target.writepy(str(package))
    else:
        with zipfile.ZipFile(archive, "w") as target:
            for path in package.rglob("*.py"):
                target.write(path, path.relative_to(package.parent))
    program = f"""
import sys
sys.path.insert(0, {str(archive)!r})
import osimlite
from osimlite.schema.descriptions import describe_property
assert osimlite.__file__.startswith({str(archive)!r})
assert "mass: one number in kg, >= 0" in osimlite.Body.__doc__
print(describe_property(osimlite.Body.field_specs()["mass"]))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == (
        "" if compiled else describe_property(osimlite.Body.field_specs()["mass"])
    )
