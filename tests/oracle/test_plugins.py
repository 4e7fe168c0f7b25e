"""Check the manual's script that generates class declarations by asking OpenSim.

Applied to OpenSim's own classes it must give the declarations of osimlite.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import osimlite
from osimlite.schema.fields import Reference
from osimlite.schema.specs import get_field_specs

pytestmark = pytest.mark.oracle

pytest.importorskip("opensim")

PAGE = Path(__file__).resolve().parents[2] / "docs" / "plugin-classes.md"
# OpenSim classes with different types of properties.
CLASSES = (
    "PathSpring", "PointToPointSpring", "ToyPropMyoController", "CustomJoint", "HopperDevice", "Marker", "SimmSpline",
    "Millard2012EquilibriumMuscle", "Thelen2003Muscle", "ExternalForce", "Kinematics",
)  # fmt: skip


def test_what_opensim_declares_is_what_the_classes_are(tmp_path):
    (script,) = re.findall(r'```python\n(""".*?)```', PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "declare.py").write_text(script)
    arguments = [sys.executable, "declare.py", "-", *CLASSES]
    done = subprocess.run(
        arguments, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    told = json.loads(done.stdout[done.stdout.index("{\n") :])["classes"]
    (tmp_path / "ours.json").write_text(
        json.dumps({"classes": {f"Our{name}": told[name] for name in told}})
    )
    ours = osimlite.classes_in(tmp_path / "ours.json")
    for name in CLASSES:
        theirs = getattr(osimlite, name)
        wanted, result = get_field_specs(theirs), get_field_specs(ours[f"Our{name}"])
        assert list(result) == list(wanted), name
        plain, made = theirs(), ours[f"Our{name}"]()
        for tag, spec in wanted.items():
            if not isinstance(spec.kind, Reference):
                assert type(result[tag].kind) is type(spec.kind), f"{name}/{tag}"
            if spec.factory is None and type(getattr(plain, spec.name)) is float:
                # OpenSim prints six digits.
                assert getattr(made, result[tag].name) == pytest.approx(
                    getattr(plain, spec.name), rel=1e-5, nan_ok=True
                )
