"""Models, helper functions and comparisons that several test modules of this folder share."""

from __future__ import annotations

import gzip
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import osimlite
from osimlite.io.document.source import Source
from osimlite.io.document.survey import survey_source
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.lint import Finding, validate
from osimlite.lint.diagnostic import Consequence
from osimlite.lint.subject import Subject
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.schema.actuators import (
    ActivationCoordinateActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.model import Model
from osimlite.schema.muscles import (
    Muscle,
    PathActuator,
    Thelen2003Muscle,
)
from tests.conftest import CorpusModel
from tests.oracle.force_carrier import along, drive
from tests.scripts import run_script

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")


# OpenSim bodies of a test model.
Bodies = list[Any]


Change = Callable[[Any, Bodies], None]


def make_vec3(*values: float) -> Any:
    """Return OpenSim's vector of three numbers."""
    return opensim.Vec3(*values)


def make_constrained_chain(rng: np.random.Generator) -> tuple[Any, Bodies]:
    """Return a model with a body on a ball joint, one on a pin beyond it, and one that floats freely.

    Returns:
        The OpenSim model and its three bodies.
    """
    opensim.Logger.setLevelString("off")
    model = opensim.Model()
    model.setName("m")
    model.setGravity(make_vec3(0.3, -9.5, 0.7))
    bodies = []
    for name in ("inner", "outer", "loose"):
        body = opensim.Body()
        body.setName(name)
        body.set_mass(rng.uniform(0.5, 2.0))
        body.set_mass_center(make_vec3(*rng.uniform(-0.2, 0.2, 3)))
        body.set_inertia(opensim.Vec6(*rng.uniform(0.2, 0.3, 3), *rng.uniform(-0.03, 0.03, 3)))
        model.addBody(body)
        bodies.append(body)
    inner, outer, loose = bodies
    for kind, name, parent, child, count in (
        ("BallJoint", "ball", model.getGround(), inner, 3),
        ("PinJoint", "pin", inner, outer, 1),
        ("FreeJoint", "free", model.getGround(), loose, 6),
    ):
        spots = [make_vec3(*rng.uniform(-size, size, 3)) for size in (0.3, 1.0, 0.3, 1.0)]
        joint = getattr(opensim, kind)(name, parent, spots[0], spots[1], child, spots[2], spots[3])
        for index in range(count):
            coordinate = joint.upd_coordinates(index)
            coordinate.setName(f"{name}_{index}")
            coordinate.set_default_value(0.2 * (index + 1))
        model.addJoint(joint)
    return model, bodies


def _point(model: Any, bodies: Bodies) -> None:
    model.addConstraint(
        opensim.PointConstraint(
            bodies[1], make_vec3(0.1, 0.2, 0.3), bodies[2], make_vec3(0.2, -0.1, 0.1)
        )
    )


def _rod(model: Any, bodies: Bodies) -> None:
    constraint = opensim.ConstantDistanceConstraint(
        bodies[1], make_vec3(0.1, 0.2, 0.3), bodies[2], make_vec3(0.2, -0.1, 0.1), 0.8
    )
    model.addConstraint(constraint)


def _line(model: Any, bodies: Bodies) -> None:
    constraint = opensim.PointOnLineConstraint(
        bodies[1],
        make_vec3(0.3, 1.0, -0.2),
        make_vec3(0.1, 0.0, 0.2),
        bodies[2],
        make_vec3(0.2, -0.1, 0.1),
    )
    model.addConstraint(constraint)


def _weld(model: Any, bodies: Bodies) -> None:
    constraint = opensim.WeldConstraint(
        "weld",
        bodies[1],
        make_vec3(0.1, 0.2, 0.3),
        make_vec3(0.3, 0.2, 0.1),
        bodies[2],
        make_vec3(0.0, 0.1, 0.0),
        make_vec3(0.1, 0.3, 0.2),
    )
    model.addConstraint(constraint)


def _point_on_offset_frame(model: Any, bodies: Bodies) -> None:
    """Add a PointConstraint on an offset frame.

    OpenSim interprets the location in the frame of the body, not in the offset frame.
    """
    frame = opensim.PhysicalOffsetFrame(
        "spot",
        bodies[1],
        opensim.Transform(
            opensim.Rotation(0.5, opensim.CoordinateAxis(1)), make_vec3(0.3, 0.0, 0.1)
        ),
    )
    bodies[1].addComponent(frame)
    constraint = opensim.PointConstraint(
        bodies[0], make_vec3(0.1, 0.2, 0.3), bodies[2], make_vec3(0.2, -0.1, 0.1)
    )
    constraint.updSocket("body_1").connect(frame)
    model.addConstraint(constraint)


def make_coupler(
    names: tuple[str, ...], dependent: str, function: Any, scale: float = 1.0
) -> Callable[[Any, Bodies], None]:
    """Return a function that adds a coordinate coupler to a model of OpenSim."""

    def add(model: Any, bodies: Bodies) -> None:
        constraint = opensim.CoordinateCouplerConstraint()
        independent = opensim.ArrayStr()
        for name in names:
            independent.append(name)
        constraint.setIndependentCoordinateNames(independent)
        constraint.setDependentCoordinateName(dependent)
        constraint.setFunction(function)
        opensim.PropertyHelper.setValueDouble(scale, constraint.updPropertyByName("scale_factor"))
        model.addConstraint(constraint)

    return add


def _spline() -> Any:
    spline = opensim.SimmSpline()
    for x, y in ((-2.0, 0.4), (-0.7, 0.1), (0.3, 0.5), (1.1, 0.2), (2.5, -0.3)):
        spline.addPoint(x, y)
    return spline


def _polynomial() -> Any:
    return opensim.PolynomialFunction(opensim.Vector.createFromMat(np.array((0.3, -0.5, 0.2, 0.1))))


def make_linear_function(coefficients: tuple[float, ...]) -> Any:
    """Return OpenSim's linear function, whose last coefficient is the constant."""
    array = opensim.ArrayDouble()
    for value in coefficients:
        array.append(value)
    function = opensim.LinearFunction()
    function.setCoefficients(array)
    return function


def _prescribed(model: Any, bodies: Bodies) -> None:
    for joint, place, function in (
        ("pin", 0, opensim.Sine(0.4, 3.0, 0.2, 0.1)),
        ("ball", 1, make_linear_function((0.5, 0.2))),
    ):
        coordinate = model.updJointSet().get(joint).upd_coordinates(place)
        coordinate.setPrescribedFunction(function)
        coordinate.set_prescribed(True)


def _prescribed_with_rod(model: Any, bodies: Bodies) -> None:
    _prescribed(model, bodies)
    _rod(model, bodies)


# Constraints and prescribed coordinates by name, as functions that add them to the model of `make_constrained_chain`.
CASES: dict[str, Change] = {
    "point": _point,
    "rod": _rod,
    "line": _line,
    "weld": _weld,
    "point-on-offset-frame": _point_on_offset_frame,
    "coupler-spline": make_coupler(("pin_0",), "free_3", _spline()),
    "coupler-of-ball-angles": make_coupler(("ball_1",), "ball_0", _polynomial(), 0.6),
    "coupler-of-two": make_coupler(
        ("ball_0", "pin_0"), "free_1", make_linear_function((0.4, -0.7, 0.1))
    ),
    "prescribed": _prescribed,
    "prescribed-with-rod": _prescribed_with_rod,
}


def ask(script: str, folder: Path, *words: str) -> None:
    """Run a Python script that uses OpenSim in another process, because OpenSim may crash."""
    run_script(script, *words, folder=folder)


def model_with(kind: str) -> osimlite.Model:
    """Return a model with pelvis, thigh, shank and markers.

    Args:
        kind: how the knee is treated: clamped, coupled, locked or loose.
    """
    model = osimlite.Model(name="leg")
    carrier: Any = model.ground
    for number, joint in enumerate(
        (osimlite.FreeJoint, osimlite.BallJoint, osimlite.UniversalJoint)
    ):
        body = osimlite.Body(name=f"b{number}", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
        model.add(body)
        at = model.add(
            osimlite.PhysicalOffsetFrame(
                name=f"f{number}",
                socket_parent=carrier,
                translation=(0.0, -0.4 * (number > 0), 0.0),
            )
        )
        model.add(joint(name=f"j{number}", socket_parent_frame=at, socket_child_frame=body))
        for count, point in enumerate(
            ((0.1, 0.0, 0.05), (0.0, -0.2, -0.06), (-0.08, -0.3, 0.04), (0.02, -0.1, 0.1))
        ):
            model.add(
                osimlite.Marker(name=f"m{number}{count}", socket_parent_frame=body, location=point)
            )
        carrier = body
    knee = [item for item in model.components(osimlite.Coordinate) if "/j2/" in item.path]
    for number, item in enumerate(knee):
        item.name = f"knee{number}"
    if kind == "clamped":
        knee[0].clamped, knee[0].range = True, (-0.3, 2.0)
    if kind == "locked":
        knee[1].locked, knee[1].default_value = True, 0.1
    if kind == "coupled":
        model.add(
            osimlite.CoordinateCouplerConstraint(
                name="c",
                independent_coordinate_names=("knee0",),
                dependent_coordinate_name="knee1",
                coupled_coordinates_function=osimlite.PolynomialFunction(
                    coefficients=(0.4, -0.3, 0.05)
                ),
            )
        )
    return model


class Place(NamedTuple):
    """Reference to a component in a text: kind of the reference, offset, and the word itself."""

    kind: str  # class and property
    start: int
    word: str


class Target(NamedTuple):
    """Component that a reference leads to: class, name, range of its element, offset of its name attribute."""

    cls: str  # class of the component
    name: str
    start: int  # offsets of its element
    end: int
    name_start: int  # offset of its name attribute


class Victim(NamedTuple):
    """Model to be broken by a test.

    It has the text, the folder with the files that the model needs, references and their targets by
    kind.
    """

    name: str
    folder: Path
    text: str
    places: dict[str, list[Place]]  # references by kind
    names: list[str]  # all names that references use
    targets: dict[str, list[Target]]  # components that references lead to, by class


def places_of(source: Source) -> Iterator[Place]:
    """Yield every reference to a component whose value stands in the text of the document."""
    subject = Subject(survey_source(source))
    seen = set()
    for use in subject.uses:
        if use.reference.rule in ("file", "column", "positional", "point-index", "input"):
            continue
        number = use.holder.source_index
        if number is None or not isinstance(use.value, str):
            continue
        if use.spec.name == "name":
            line, column, _ = source.locate_attribute(number, "name")
            start, kind = source.line_start(line) + column - 1, f"{type(use.holder).__name__}.name"
        else:
            element = source.child(number, use.spec.tag)
            if element is None:
                continue
            span = source.spans[element]
            start = source.text.find(use.value, span.tag_end, span.inner_end)
            kind = f"{use.spec.declared_in.__name__}.{use.spec.tag}"
        if source.text.startswith(use.value, start) and start >= 0 and start not in seen:
            seen.add(start)
            yield Place(kind, start, use.value)


def targets_of(source: Source) -> Iterator[Target]:
    """Yield every component of a document that has a name in the text and that a reference leads to."""
    subject = Subject(survey_source(source))
    seen = set()
    for use in subject.uses:
        target = subject.resolution(use).target
        if (
            target is None
            or target.source_index is None
            or target is use.owner
            or target.source_index in seen
        ):
            continue
        seen.add(target.source_index)
        span = source.spans[target.source_index]
        line, column, _ = source.locate_attribute(target.source_index, "name")
        start = source.line_start(line) + column - 1
        if target.name and source.text.startswith(f'"{target.name}"', start - 1):
            yield Target(type(target).__name__, target.name, span.start, span.end, start)


def victim(model: CorpusModel, folder: Path) -> Victim | None:
    """Return OpenSim's print of a model with its references, for tests that break them.

    The result is None if OpenSim cannot load the model, if the linter finds errors in it, or if it
    has no references.
    """
    if model.converted is None:
        return None
    folder.mkdir()
    for other in model.path.parent.iterdir():
        if other.is_file() and other != model.path:
            shutil.copy(other, folder / other.name)
    text = gzip.decompress(model.converted.read_bytes()).decode()
    source = Source(text.encode())
    if not validate(source, ignore="OSIM63").ok:
        return None
    places: dict[str, list[Place]] = {}
    for place in places_of(source):
        places.setdefault(place.kind, []).append(place)
    names = sorted({place.word for group in places.values() for place in group})
    targets: dict[str, list[Target]] = {}
    for target in targets_of(source):
        targets.setdefault(target.cls, []).append(target)
    return Victim(model.id, folder, text, places, names, targets) if names else None


def claims_refusal(finding: Finding) -> bool:
    """Return whether a finding says that OpenSim rejects the model."""
    return finding.consequence is Consequence.REFUSES


# Properties that the new muscles take from the old ones.
KEPT = (
    "name",
    "max_isometric_force",
    "optimal_fiber_length",
    "tendon_slack_length",
    "pennation_angle_at_optimal",
)


def with_muscles_of(model: Model, cls: type[Muscle], more: dict[str, Any]) -> Model:
    """Return the model with all muscles replaced by muscles of another class.

    Args:
        model: model that is changed.
        cls: new class of the muscles.
        more: further properties of the new muscles.
    """
    forces = model.force_set.objects
    for index, muscle in enumerate(list(forces)):
        if isinstance(muscle, Muscle):
            forces[index] = cls(**{name: getattr(muscle, name) for name in KEPT}, **more)
            forces[index].geometry_path = muscle.geometry_path.copy_deep()
    return model


# Operations of probes.
OPERATIONS = "value", "integrate", "differentiate", "minimum", "minabs", "maximum", "maxabs"


def add_actuators(model):
    """Add actuators of each class that has one control and acts on bodies or coordinates."""
    bodies = {"bodyA": "b2", "bodyB": "b0"}
    for there in (False, True):
        model.add(
            PointActuator(
                name=f"point{there:d}", body="b1", point=(0.1, 0.2, 0.3), point_is_global=there
            ),
            PointToPointActuator(
                name=f"points{there:d}", pointA=(0.1, 0.2, 0.3), points_are_global=there, **bodies
            ),
            TorqueActuator(
                name=f"torque{there:d}", axis=(1.0, 2.0, -0.5), torque_is_global=there, **bodies
            ),
        )
    model.add(
        TorqueActuator(
            name="turned",
            bodyA="/bodyset/b2/f2",
            bodyB="b1",
            axis=(1.0, 0.0, 0.5),
            torque_is_global=False,
        ),
        CoordinateActuator(name="motor", coordinate="q1_0", optimal_force=7.0),
        CoordinateActuator(name="off", coordinate="q0_0", appliesForce=False),
        ActivationCoordinateActuator(name="slow", coordinate="q2_0"),
        *along(PathActuator, optimal_force=30.0),
    )
    muscles = along(Thelen2003Muscle, optimal_fiber_length=0.4)
    for muscle in muscles:
        muscle.name = f"muscle_{muscle.name}"
    model.add(*muscles)
    names = [force.name for force in model.force_set.objects]
    drive(model, *names)


TOOL_SETUP = """<OpenSimDocument Version="40600">
    <{tool} name="it">
        <model_file>model.osim</model_file>
        <results_directory>{results}</results_directory>
        <coordinates_file>motion.mot</coordinates_file>
        <lowpass_cutoff_frequency_for_coordinates>{cutoff}</lowpass_cutoff_frequency_for_coordinates>
        {more}
    </{tool}>
</OpenSimDocument>
"""


def build_printed(model: Any, folder: Path) -> Mechanism:
    """Print an OpenSim model to a file and return osimlite's mechanism of it."""
    model.finalizeConnections()
    path = folder / "model.osim"
    model.printToXML(str(path))
    return build_mechanism(osimlite.read(path))


def real(corpus: Any, name: str) -> Path:
    """Return the file of a corpus model."""
    path: Path = next(model.path for model in corpus if model.id == name)
    return path


def both(
    folder: Path, model: Model, tool: str, more: str, cutoff: float = -1.0,
    change: Callable[[Path], object] | None = None,
) -> tuple[Path, Path]:  # fmt: skip
    """Run a tool on a motion of a model with osimlite and with OpenSim.

    Args:
        folder: folder for all files.
        model: model to be analysed.
        tool: class of the tool.
        more: further lines of the setup.
        cutoff: cut-off frequency of the filter (Hz), negative for no filter.
        change: function that changes the motion file before both runs.

    Returns:
        The output folders of osimlite and of OpenSim.
    """
    osimlite.write(model, folder / "model.osim")
    mechanism = osimlite.mechanism(model)
    times = np.linspace(0.0, 0.5, 26)
    infos = mechanism.coordinates
    rows = np.array(
        [
            info.default_value + 0.15 * np.sin(5 * times + k) * (not info.locked)
            for k, info in enumerate(infos)
        ]
    )
    if mechanism.constraints and tool != "InverseDynamicsTool":
        # While fulfilling constraints, OpenSim moves coordinates by 1e-5 rad off the ends of their
        # ranges. The motion therefore stays away from the ends.
        low, high = np.array([info.range for info in infos]).T[:, :, None]
        starts = np.clip(rows[:, :1], low + 0.2, high - 0.2)
        moved = np.clip(rows + starts - rows[:, :1], low + 0.1, high - 0.1)
        rows = np.where(np.array([[info.locked] for info in infos]), rows, moved)
        rows = np.array([mechanism.assemble(q) for q in rows.T]).T
    turns = [info.motion_type == "rotational" for info in mechanism.coordinates]
    write_sto(
        folder / "motion.mot", "motion", times, mechanism.coordinate_names,
        np.where(turns, np.degrees(rows.T), rows.T).tolist(), in_degrees=True,
    )  # fmt: skip
    if change is not None:
        change(folder)
    for results in ("ours", "theirs"):
        (folder / f"{results}.xml").write_text(
            TOOL_SETUP.format(tool=tool, results=results, cutoff=cutoff, more=more)
        )
    script = f"import opensim; opensim.Logger.setLevelString('Error'); assert opensim.{tool}('theirs.xml').run()"
    run_script(script, folder=folder)
    osimlite.run(folder / "ours.xml")
    return folder / "ours", folder / "theirs"


def compare(ours: Path, theirs: Path, tolerance: float, small: float = 1e-11) -> None:
    """Compare two output folders: same files, headers, labels and times, and nearly equal numbers.

    Args:
        ours: output folder of osimlite.
        theirs: output folder of OpenSim.
        tolerance: largest difference relative to the largest number of the column.
        small: absolute difference that is allowed in addition.
    """
    assert sorted(path.name for path in ours.iterdir()) == sorted(
        path.name for path in theirs.iterdir()
    )
    for file in ours.iterdir():
        one, two = (
            path.read_text().partition("endheader\n") for path in (file, theirs / file.name)
        )
        assert (one[0], one[2].partition("\n")[0]) == (two[0], two[2].partition("\n")[0]), file.name
        mine, known = read_sto(file), read_sto(theirs / file.name)
        assert mine.times.tolist() == known.times.tolist()
        largest = np.abs(known.rows).max(axis=0)
        assert (np.abs(mine.rows - known.rows).max(axis=0) <= tolerance * largest + small).all(), (
            file.name
        )


COMMENT_LINE = re.compile(r"[ \t]*<!--.*?-->\n", re.DOTALL)
