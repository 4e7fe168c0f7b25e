"""What the rules on contradictions and missing parts report, OpenSim refuses; the sound spelling it takes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from osimlite.document.source import Source
from osimlite.lint import validate

pytestmark = pytest.mark.oracle
pytest.importorskip("opensim")

HERE = Path(__file__).resolve().parent
SKELETON = (HERE.parents[1] / "fixtures" / "lint" / "skeleton.osim").read_text(encoding="utf-8")
POINTS = "".join(
    f'<PathPoint name="{body}"><socket_parent_frame>/bodyset/{body}</socket_parent_frame></PathPoint>'
    for body in ("pelvis", "shank")
)
PATH = f'<GeometryPath name="path"><PathPointSet><objects>{POINTS}</objects></PathPointSet></GeometryPath>'
FIBRES = "<optimal_fiber_length>0.1</optimal_fiber_length><tendon_slack_length>0.2</tendon_slack_length>"


def muscle(inside: str, kind: str = "Millard2012EquilibriumMuscle", path: str = PATH) -> str:
    force = f'<{kind} name="m">{path}<max_isometric_force>500</max_isometric_force>{FIBRES}{inside}</{kind}>'
    return SKELETON.replace("</objects>\n\t\t</ForceSet>", f"{force}\n</objects>\n\t\t</ForceSet>")


def curve(tag: str, **values: float) -> str:
    return muscle(f'<{tag} name="c">{"".join(f"<{k}>{v}</{k}>" for k, v in values.items())}</{tag}>')


REFUSED = {
    "order": curve("ActiveForceLengthCurve", min_norm_active_fiber_length=0.8, transition_norm_fiber_length=0.7),
    "plateau": curve("ActiveForceLengthCurve", max_norm_active_fiber_length=1),
    "shallow": curve("ActiveForceLengthCurve", shallow_ascending_slope=3.75),
    "isometric": curve("ForceVelocityCurve", isometric_slope=1),
    "concentric": curve("ForceVelocityCurve", concentric_slope_near_vmax=1),
    "eccentric": curve("ForceVelocityCurve", eccentric_slope_near_vmax=0.4),
    "strains": curve("FiberForceLengthCurve", strain_at_zero_force=0.8),
    "one of three": curve("TendonForceLengthCurve", curviness=0.5),
    "optimal force": muscle("<optimal_force>1</optimal_force>", "DeGrooteFregly2016Muscle"),
    "no path": muscle("", path=""),
    "name of a set": SKELETON.replace('<BodySet name="bodyset">', '<BodySet name="body set">'),
    "no coordinates": SKELETON.replace("<coordinates>", "<coordinates></coordinates><!--", 1).replace(
        "</coordinates>\n", "-->\n", 1
    ),
}
TAKEN = {
    "muscle": muscle(""),
    "shallow": curve("ActiveForceLengthCurve", shallow_ascending_slope=3.6),
    "eccentric": curve("ForceVelocityCurve", eccentric_slope_near_vmax=0.39),
    "namespace": SKELETON.replace('Version="40600"', 'Version="+40600" xmlns="http://example.org"'),
    "unquoted": SKELETON.replace('name="pelvis"', "name=pelvis"),
}


def test_opensim_refuses_what_is_an_error_and_takes_what_is_none(tmp_path: Path) -> None:
    cases = {**{f"refused {k}": v for k, v in REFUSED.items()}, **{f"taken {k}": v for k, v in TAKEN.items()}}
    files = []
    for number, text in enumerate(cases.values()):
        files.append(tmp_path / f"{number}.osim")
        files[-1].write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(HERE / "opensim_verdicts.py")],
        input="".join(f"{file}\n" for file in files), capture_output=True, text=True, check=True, cwd=tmp_path,
    )  # fmt: skip
    verdicts = [json.loads(line) for line in done.stdout.splitlines()]
    for (name, text), verdict in zip(cases.items(), verdicts, strict=True):
        errors = validate(Source(text.encode())).errors
        assert bool(errors) == (verdict is not None) == name.startswith("refused"), (name, verdict, errors)
