"""Compare the linter's verdict on unusual custom joints with OpenSim's.

There must be an error where OpenSim rejects the model, crashes, or computes NaN.
"""

from __future__ import annotations

import faulthandler
import os
import signal
from pathlib import Path

import pytest

from osimlite.lint import validate

pytestmark = pytest.mark.oracle

X, Y, Z = "1 0 0", "0 1 0", "0 0 1"
AXES = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")
SPLINE = "<SimmSpline><x>-2 -1 0 1 2</x><y>-2.5 -1 0 1 2.2</y></SimmSpline>"
FLAT = "<SimmSpline><x>-2 -1 0 1 2</x><y>1 1 1 1 1</y></SimmSpline>"
LOCKED = "<locked>true</locked>"


def linear(*coefficients: float) -> str:
    return f"<LinearFunction><coefficients>{' '.join(map(str, coefficients))}</coefficients></LinearFunction>"


def square(*coefficients: float) -> str:
    return f"<PolynomialFunction><coefficients>{' '.join(map(str, coefficients))}</coefficients></PolynomialFunction>"


def document(
    coordinates: str, on: dict[int, tuple[str, str]], axes: tuple[str, ...] = (), inside: str = ""
) -> str:
    """Return a model with a body on a custom joint.

    Args:
        coordinates: name of each coordinate, one letter each.
        on: coordinates and function of each axis, by the index of the axis.
        axes: directions of the six axes, X, Y, Z twice by default.
        inside: properties of each coordinate.
    """
    rows = ""
    for number, name in enumerate(AXES):
        names, function = on.get(number, ("", ""))
        axis = axes[number] if axes else (X, Y, Z)[number % 3]
        rows += f'<TransformAxis name="{name}"><coordinates>{" ".join(names)}</coordinates><axis>{axis}</axis>{function}'
        rows += "</TransformAxis>"
    return f"""<OpenSimDocument Version="40600"><Model name="m">
        <BodySet><objects><Body name="b">
            <mass>1</mass><mass_center>0.1 0.2 0.3</mass_center><inertia>1.5 1.25 1.75 0 0 0</inertia>
        </Body></objects></BodySet>
        <JointSet><objects><CustomJoint name="j">
            <socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/b</socket_child_frame>
            <coordinates>{"".join(f'<Coordinate name="{c}">{inside}</Coordinate>' for c in coordinates)}</coordinates>
            <SpatialTransform>{rows}</SpatialTransform>
        </CustomJoint></objects></JointSet>
    </Model></OpenSimDocument>"""


ONE = {0: ("a", linear(1, 0))}
# Custom joints by what is unusual about them.
CASES = {
    "sound": document("a", ONE),
    "no function": document("a", {0: ("a", "")}),
    "no function, locked": document("a", {0: ("a", "")}, inside=LOCKED),
    "constant": document("a", {0: ("a", "<Constant><value>1</value></Constant>")}),
    "weight 0": document("a", {0: ("a", linear(0, 1))}),
    "one coefficient": document("a", {0: ("a", linear(1))}),
    "three coefficients": document("a", {0: ("a", linear(1, 2, 3))}),
    "no coefficient": document("a", {0: ("a", linear())}),
    "on no axis": document("ab", ONE),
    "no second variable": document("ab", {0: ("ab", linear(1, 0))}),
    "no second variable, elsewhere": document(
        "ab", {0: ("ab", linear(1, 0)), 1: ("b", linear(1, 0))}
    ),
    "second variable of a spline": document("ab", {0: ("ab", SPLINE)}),
    "second variable of a spline, elsewhere": document(
        "ab", {0: ("ab", SPLINE), 1: ("b", linear(1, 0))}
    ),
    "the same motion": document("ab", {0: ("ab", linear(1, 1, 0))}),
    "the same motions": document("ab", {0: ("ab", linear(1, 1, 0)), 1: ("ab", linear(1, 1, 0))}),
    "two motions": document("ab", {0: ("ab", linear(1, 1, 0)), 1: ("ab", linear(1, -1, 0))}),
    "flat spline": document("a", {0: ("a", FLAT)}),
    "flat in the default pose": document("a", {0: ("a", square(1, 0, 0))}),
    "polynomial": document("a", {0: ("a", square(1, 0.5, 0))}),
    "times 0": document(
        "a",
        {
            0: (
                "a",
                f"<MultiplierFunction><function>{linear(1, 0)}</function><scale>0</scale></MultiplierFunction>",
            )
        },
    ),
    "nothing to multiply": document("a", {0: ("a", "<MultiplierFunction/>")}),
    "no coordinate": document("", {}),
    "no length": document("a", ONE, (X, "0 0 0", Z, X, Y, Z)),
    "opposite": document("a", ONE, (X, "-1 0 0", Z, X, Y, Z)),
    "parallel translations": document("a", ONE, (X, Y, Z, X, Y, X)),
    "almost parallel": document("a", ONE, (X, "1 1.1e-5 0", Z, X, Y, Z)),
    "as good as parallel": document("a", ONE, (X, "1 0.9e-5 0", Z, X, Y, Z)),
    "short": document("a", ONE, ("1e-3 0 0", "0 1e-3 0", Z, X, Y, Z)),
    "in one plane": document("a", ONE, (X, Y, "1 1 0", X, Y, Z)),
}

# OpenSim computes a result without a message. It depends on undefined memory, or is not a function
# of both variables.
SILENT = (
    "one coefficient",
    "no second variable, elsewhere",
    "second variable of a spline, elsewhere",
)


def fails(path: Path) -> bool:
    """Return whether OpenSim rejects the model, crashes, or computes NaN for an acceleration.

    OpenSim runs in a child process.
    """
    opensim = pytest.importorskip("opensim")
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        # A crash is an expected result here. Pytest's fault handler would print a traceback.
        faulthandler.disable()
        try:
            opensim.Logger.setLevelString("Off")
            model = opensim.Model(str(path))
            state = model.initSystem()
            model.realizeAcceleration(state)
            rates = state.getUDot()
            os._exit(int(any(rates[n] != rates[n] for n in range(rates.size()))))
        except RuntimeError:
            os._exit(1)
    return os.waitpid(child, 0)[1] != 0


@pytest.mark.parametrize("case", CASES)
def test_there_is_an_error_where_opensim_fails(case, tmp_path):
    path = tmp_path / "joint.osim"
    path.write_text(CASES[case])
    report = validate(path)
    assert bool(report.errors) == (case in SILENT or fails(path)), str(report)
