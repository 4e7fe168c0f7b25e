"""Compare rules about contradictions and missing parts with OpenSim.

OpenSim must reject what the rules report, and accept the correct form.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
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
FIBRES = (
    "<optimal_fiber_length>0.1</optimal_fiber_length><tendon_slack_length>0.2</tendon_slack_length>"
)


def muscle(inside: str, kind: str = "Millard2012EquilibriumMuscle", path: str = PATH) -> str:
    force = f'<{kind} name="m">{path}<max_isometric_force>500</max_isometric_force>{FIBRES}{inside}</{kind}>'
    return SKELETON.replace("</objects>\n\t\t</ForceSet>", f"{force}\n</objects>\n\t\t</ForceSet>")


def curve(
    tag: str, kind: str = "Millard2012EquilibriumMuscle", more: str = "", **values: float
) -> str:
    return muscle(
        f'{more}<{tag} name="c">{"".join(f"<{k}>{v}</{k}>" for k, v in values.items())}</{tag}>',
        kind,
    )


def by_functions(
    coordinates: str = "/jointset/knee/knee_angle", length: str = "0.1 0.4", more: str = ""
) -> str:
    return muscle(
        "",
        path=f'<FunctionBasedPath name="path"><coordinate_paths>{coordinates}</coordinate_paths><length_function>'
        f"<LinearFunction><coefficients>{length}</coefficients></LinearFunction></length_function>{more}"
        "</FunctionBasedPath>",
    )


THELEN, ACCELERATION = "Thelen2003Muscle", "Millard2012AccelerationMuscle"
CLASSIC = "<fiber_damping>0</fiber_damping>"


# Components that OpenSim rejects, by what is wrong.
REFUSED = {
    "order": curve(
        "ActiveForceLengthCurve", min_norm_active_fiber_length=0.8, transition_norm_fiber_length=0.7
    ),
    "plateau": curve("ActiveForceLengthCurve", max_norm_active_fiber_length=1),
    "shallow": curve("ActiveForceLengthCurve", shallow_ascending_slope=3.75),
    "isometric": curve("ForceVelocityCurve", isometric_slope=1),
    "concentric": curve("ForceVelocityCurve", concentric_slope_near_vmax=1),
    "eccentric": curve("ForceVelocityCurve", eccentric_slope_near_vmax=0.4),
    "strains": curve("FiberForceLengthCurve", strain_at_zero_force=0.8),
    "one of three": curve("TendonForceLengthCurve", curviness=0.5),
    "corner of shoulders": curve("ActiveForceLengthCurve", max_norm_active_fiber_length=1.0001),
    "corner at rest": curve("ForceVelocityCurve", isometric_slope=1.01),
    "slow end": curve("ForceVelocityCurve", more=CLASSIC, concentric_slope_at_vmax=0.25),
    "fast end": curve("ForceVelocityCurve", more=CLASSIC, eccentric_slope_at_vmax=0.2),
    "end of a mass": curve("ForceVelocityCurve", ACCELERATION, concentric_slope_at_vmax=0.3),
    "long toe": curve("FiberForceLengthCurve", strain_at_one_norm_force=5),
    "corner of toe": curve(
        "FiberForceLengthCurve",
        stiffness_at_low_force=0.2,
        stiffness_at_one_norm_force=1.44,
        curviness=0.5,
    ),
    "soft end": curve(
        "FiberCompressiveForceLengthCurve", ACCELERATION, stiffness_at_zero_length=-1, curviness=0.5
    ),
    "only stiffness": curve(
        "FiberCompressiveForceCosPennationCurve", ACCELERATION, stiffness_at_perpendicular=-20
    ),
    "right angle": curve(
        "FiberCompressiveForceCosPennationCurve", ACCELERATION, engagement_angle_in_degrees=90
    ),
    "rigid": muscle("<ignore_tendon_compliance>true</ignore_tendon_compliance>", THELEN),
    "excited": muscle("<ignore_activation_dynamics>true</ignore_activation_dynamics>", THELEN),
    "old rigid": muscle(
        "<ignore_tendon_compliance>true</ignore_tendon_compliance>", "Schutte1993Muscle_Deprecated"
    ),
    "old excited": muscle(
        "<ignore_activation_dynamics>true</ignore_activation_dynamics>", "Delp1990Muscle_Deprecated"
    ),
    "first excited": muscle(
        "<ignore_activation_dynamics>true</ignore_activation_dynamics>",
        "Thelen2003Muscle_Deprecated",
    ),
    "early line": muscle("<fv_linear_extrap_threshold>0.7</fv_linear_extrap_threshold>", THELEN),
    "full": muscle("<min_control>1</min_control><minimum_activation>1</minimum_activation>"),
    "below": muscle("<minimum_activation>0.02</minimum_activation>"),
    "classic": muscle(
        f"<min_control>0</min_control>{CLASSIC}<minimum_activation>0.005</minimum_activation>"
    ),
    "tense": muscle(
        "<default_normalized_tendon_force>6</default_normalized_tendon_force>",
        "DeGrooteFregly2016Muscle",
    ),
    "of nothing": by_functions("", "0.4"),
    "of one twice": by_functions(
        "/jointset/knee/knee_angle /jointset/knee/knee_angle", "0.1 0.1 0.4"
    ),
    "of too few": by_functions(length="0.4"),
    "flat arm": by_functions(
        more="<moment_arm_functions><Constant><value>1</value></Constant></moment_arm_functions>"
    ),
    "optimal force": muscle("<optimal_force>1</optimal_force>", "DeGrooteFregly2016Muscle"),
    "no path": muscle("", path=""),
    "name of a set": SKELETON.replace('<BodySet name="bodyset">', '<BodySet name="body set">'),
    "no coordinates": SKELETON.replace(
        "<coordinates>", "<coordinates></coordinates><!--", 1
    ).replace("</coordinates>\n", "-->\n", 1),
}
# Similar components that OpenSim accepts.
TAKEN = {
    "muscle": muscle(""),
    "damped end": curve(
        "ForceVelocityCurve", concentric_slope_at_vmax=0.9, eccentric_slope_at_vmax=0.3
    ),
    "classic end": curve("ForceVelocityCurve", more=CLASSIC, concentric_slope_at_vmax=0.2),
    "least": curve("ActiveForceLengthCurve", minimum_value=2),
    "at rest": curve("ForceVelocityCurve", isometric_slope=1.1),
    "long toe": curve("FiberForceLengthCurve", strain_at_one_norm_force=4.9),
    "late line": muscle("<fv_linear_extrap_threshold>0.72</fv_linear_extrap_threshold>", THELEN),
    "undamped": muscle(
        "<min_control>0.005</min_control><minimum_activation>0.005</minimum_activation>"
    ),
    "by functions": by_functions(),
    "shallow": curve("ActiveForceLengthCurve", shallow_ascending_slope=3.6),
    "eccentric": curve("ForceVelocityCurve", eccentric_slope_near_vmax=0.39),
    "namespace": SKELETON.replace('Version="40600"', 'Version="+40600" xmlns="http://example.org"'),
    "unquoted": SKELETON.replace('name="pelvis"', "name=pelvis"),
}


def test_opensim_refuses_what_is_an_error_and_takes_what_is_none(tmp_path: Path) -> None:
    cases = {
        **{f"refused {k}": v for k, v in REFUSED.items()},
        **{f"taken {k}": v for k, v in TAKEN.items()},
    }
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
        assert bool(errors) == (verdict is not None) == name.startswith("refused"), (
            name,
            verdict,
            errors,
        )


@pytest.mark.parametrize(("name", "points"), [("fail-01-example", 2), ("pass-example", 4)])
def test_a_path_goes_straight_through_a_surface_that_holds_its_point(
    name: str, points: int
) -> None:
    """Check the statement of rule OSIM616 about points inside of a wrap object."""
    import opensim

    opensim.Logger.setLevelString("Off")
    model = opensim.Model(str(HERE.parents[1] / "fixtures" / "lint" / "OSIM616" / f"{name}.osim"))
    state = model.initSystem()
    for coordinate, value in (("hip_flexion", 0.0), ("knee_angle", -1.9)):
        model.getCoordinateSet().get(coordinate).setValue(state, value)
    model.realizePosition(state)
    path = opensim.GeometryPath.safeDownCast(model.getComponent("/forceset/spring/path"))
    assert path.getCurrentPath(state).getSize() == points
