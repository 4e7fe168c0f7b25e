"""Check that a rule reports every reason for which the builder rejects a model."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.errors import ModelError, OsimliteError, UnsupportedError
from osimlite.io.document.reader import read_text
from osimlite.io.document.source import Source
from osimlite.lint import construction as remembering
from osimlite.lint import validate
from osimlite.lint.measuring import construction
from osimlite.simulation.elements.builder import ElementBuilder
from tests.lint.builder_messages import Message, read_messages
from tests.lint.verdict_cases import CASES, path_of, small_model

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures" / "lint"
SPRING = '<SpringGeneralizedForce name="f"><coordinate>q</coordinate></SpringGeneralizedForce>'
BAND = path_of(("/ground", "0 1 0"), ("/bodyset/a", "0 0 0"))


def _obstacle_of(name: str, hint: str = "") -> str:
    """Return an obstacle of a path, which refers to a contact geometry."""
    return (
        f'<Scholz2015GeometryPathObstacle name="o{name}"><socket_contact_geometry>/contactgeometryset/{name}'
        f"</socket_contact_geometry>{hint}</Scholz2015GeometryPathObstacle>"
    )


def _lay_cable(geometry: str, obstacles: str) -> str:
    """Return the text of a model with a path over obstacles."""
    start, end = (
        f'<Scholz2015GeometryPathPoint name="{frame[-1]}"><PathPoint name="x"><socket_parent_frame>{frame}'
        f"</socket_parent_frame><location>{place}</location></PathPoint></Scholz2015GeometryPathPoint>"
        for frame, place in (("/ground", "-0.45 -0.28 0"), ("/bodyset/a", "0.4 0.02 0"))
    )
    path = (
        f'<Scholz2015GeometryPath name="path"><path_elements>{start}{obstacles}{end}</path_elements>'
        "</Scholz2015GeometryPath>"
    )
    return small_model(geometry=geometry, forces=f'<PathActuator name="f">{path}</PathActuator>')


MODELS = {
    "a path around a surface of no size": small_model(
        children='<WrapObjectSet name="wrapobjectset"><objects><WrapSphere name="w">'
        "<radius>-1</radius></WrapSphere></objects></WrapObjectSet>",
        forces='<PathSpring name="f">'
        + BAND.replace(
            "</GeometryPath>",
            '<PathWrapSet><objects><PathWrap name="p"><wrap_object>w</wrap_object></PathWrap>'
            "</objects></PathWrapSet></GeometryPath>",
        )
        + "<resting_length>1</resting_length><stiffness>1</stiffness><dissipation>0</dissipation>"
        "</PathSpring>",
    ),
    "a contact mesh without a file": small_model(
        geometry='<ContactMesh name="x"><socket_frame>/bodyset/a</socket_frame></ContactMesh>'
        '<ContactHalfSpace name="y"><socket_frame>/ground</socket_frame></ContactHalfSpace>',
        forces='<ElasticFoundationForce name="f"><ElasticFoundationForce::ContactParametersSet '
        'name="contact_parameters"><objects><ElasticFoundationForce::ContactParameters>'
        "<geometry>x y</geometry></ElasticFoundationForce::ContactParameters></objects>"
        "</ElasticFoundationForce::ContactParametersSet></ElasticFoundationForce>",
    ),
    "an ellipsoid without radii": small_model(
        geometry='<ContactEllipsoid name="x"><socket_frame>/bodyset/a</socket_frame></ContactEllipsoid>'
        '<ContactHalfSpace name="y"><socket_frame>/ground</socket_frame></ContactHalfSpace>',
        forces='<HuntCrossleyForce name="f"><HuntCrossleyForce::ContactParametersSet '
        'name="contact_parameters"><objects><HuntCrossleyForce::ContactParameters>'
        "<geometry>x y</geometry></HuntCrossleyForce::ContactParameters></objects>"
        "</HuntCrossleyForce::ContactParametersSet></HuntCrossleyForce>",
    ),
    "an inertia that is no number": small_model().replace(
        "<inertia>0.1 0.1", "<inertia>NaN 0.1", 1
    ),
    "a place that is no number": small_model().replace("<translation>0 0.3", "<translation>0 NaN"),
    "a number of a force that is none": small_model(
        forces=SPRING.replace("</coordinate>", "</coordinate><stiffness>NaN</stiffness>")
    ),
    "a coupler with too few coefficients": small_model(
        constraints='<CoordinateCouplerConstraint name="c"><coupled_coordinates_function><LinearFunction>'
        "<coefficients>1</coefficients></LinearFunction></coupled_coordinates_function>"
        "<independent_coordinate_names>q</independent_coordinate_names>"
        "<dependent_coordinate_name>s</dependent_coordinate_name></CoordinateCouplerConstraint>"
    ),
    "a name that leads nowhere": small_model(forces=SPRING.replace(">q<", ">p<")),
    "a line without a direction": small_model(
        constraints='<PointOnLineConstraint name="c"><socket_line_body>/ground</socket_line_body>'
        "<socket_follower_body>/bodyset/b</socket_follower_body></PointOnLineConstraint>"
    ),
    "a point in the second of two obstacles": _lay_cable(
        '<ContactSphere name="x"><socket_frame>/bodyset/a</socket_frame><radius>0.1</radius></ContactSphere>'
        '<ContactSphere name="y"><socket_frame>/ground</socket_frame><location>-0.5 -0.3 0</location>'
        "<radius>0.12</radius></ContactSphere>",
        _obstacle_of("x") + _obstacle_of("y", "<contact_hint>0 0.1 0</contact_hint>"),
    ),
    "an obstacle of negative radius": _lay_cable(
        '<ContactSphere name="x"><socket_frame>/bodyset/a</socket_frame><radius>-0.1</radius></ContactSphere>',
        _obstacle_of("x"),
    ),
    "a ring of negative radius as an obstacle": _lay_cable(
        '<ContactTorus name="x"><socket_frame>/bodyset/a</socket_frame>'
        "<torus_radius>-0.1</torus_radius><tube_radius>0.02</tube_radius></ContactTorus>",
        _obstacle_of("x"),
    ),
    "a mesh as an obstacle": _lay_cable(
        '<ContactMesh name="x"><socket_frame>/ground</socket_frame><location>9 0 0</location></ContactMesh>',
        _obstacle_of("x"),
    ),
    "an unknown constraint": small_model(constraints='<NoSuchConstraint name="c" />'),
}
"""Models for messages that no case of `verdict_cases` and no fixture causes."""

WITHOUT_MODEL = {
    "simulation/elements/builder.py": "the sum of all that is left out",
    "simulation/elements/contact.py": "frames that are none of a body, and an option",
    "simulation/elements/control_sets.py": "a file of controls beside the model",
    "simulation/elements/control_tables.py": "a file of controls beside the model",
    "simulation/elements/controllers.py": "a file of controls beside the model",
    "simulation/elements/force_type.py": "an option of static optimization",
    "simulation/elements/force_types/coordinate_forces.py": "classes after OpenSim 4.6",
    "simulation/elements/force_types/smooth_contacts.py": "reported by OSIM206 before",
    "simulation/elements/gather.py": "the sum of all that is left out",
    "simulation/elements/geometries/paths/function_based_path.py": "reported by OSIM209 before",
    "simulation/elements/geometries/paths/geometry_path.py": "words that the reader replaces, or unknown classes",
    "simulation/elements/geometries/sphere_on_plane.py": "reported by OSIM302 before",
    "simulation/elements/mechanical_probes.py": "probes are left out with a notice",
    "simulation/elements/metabolic_probes.py": "probes are left out with a notice",
    "simulation/elements/probe_type.py": "probes are left out with a notice",
    "simulation/elements/synergies.py": "signals of a table beside the model",
    "simulation/elements/triangle_mesh.py": "a mesh beside the model",
    "mechanics/multibody/assembly.py": "speeds that a call sets",
    "mechanics/multibody/build.py": "frames that are none of a body, loops",
    "mechanics/multibody/constraint_records.py": "a class that nobody has",
    "mechanics/multibody/dynamics.py": "what a call sets; the default pose is evaluated by the kernels",
    "mechanics/multibody/function_tables.py": "a class that nobody has",
    "mechanics/multibody/functions.py": "reported by OSIM604 before",
    "mechanics/multibody/joints.py": "axes that a call makes",
    "mechanics/multibody/motions.py": "poses that a call sets",
    "mechanics/multibody/schema_constraints.py": "coordinates that stand several times in a joint",
    "mechanics/multibody/schema_frames.py": "unknown classes of frames",
    "mechanics/multibody/schema_functions.py": "the reader keeps the default of an empty list",
    "mechanics/multibody/schema_joints.py": "reported by OSIM206 before",
}
"""Modules with messages that no small model causes, and what causes them."""


def messages_of(text: str | bytes, folder: Path | None = None) -> list[str]:
    """Return the messages with which the builder rejects a model."""
    try:
        model = read_text(text)
    except OsimliteError:
        return []
    obstacles, _ = construction.try_construction(model, folder)
    return [obstacle.message for obstacle in obstacles]


def test_every_message_comes_from_a_model_or_has_a_reason_why_none_is_here():
    texts = [(case.text, None) for case in CASES] + [(text, None) for text in MODELS.values()]
    for path in sorted(FIXTURES.glob("OSIM[1-7]*/fail-*.osim")):
        texts.append((path.read_bytes(), path.parent))
    said = {message for text, folder in texts for message in messages_of(text, folder)}
    missing = [
        message
        for message in read_messages()
        if message.module not in WITHOUT_MODEL and not any(map(message.matches, said))
    ]
    assert not missing, "\n".join(map(str, missing))


def test_a_reason_is_for_a_module_that_has_messages():
    assert {*WITHOUT_MODEL} <= {message.module for message in read_messages()}


@pytest.mark.parametrize("error", [ModelError, UnsupportedError])
def test_every_message_is_reported_by_a_rule_wherever_the_builder_raises_it(error, monkeypatch):
    force = SPRING.replace("SpringGeneralizedForce", "ExpressionBasedCoordinateForce")
    source = Source(small_model(forces=force).encode(), "m.osim")

    def raised(message: Message):
        def refuse(*_: object, **__: object) -> object:
            raise error(message.text.replace("{}", "x"))

        return refuse

    for message in read_messages():
        with monkeypatch.context() as context:
            if message.module.startswith("mechanics/multibody"):
                context.setattr(construction, "build_mechanism", raised(message))
            else:
                context.setattr(ElementBuilder, "make_element", raised(message))
            remembering.forget_obstacles()
            report = validate(source)
        codes = {"OSIM421", "OSIM531"} if error is ModelError else {"OSIM533"}
        assert codes & {*report.codes}, f"{message}:\n{report}"


@pytest.mark.parametrize("name", MODELS)
def test_a_model_that_the_builder_refuses_has_a_finding(name):
    assert messages_of(MODELS[name])
    report = validate(Source(MODELS[name].encode(), "m.osim"), ignore="OSIM63")
    assert report.errors or report.warnings or "OSIM533" in report.codes, str(report)
