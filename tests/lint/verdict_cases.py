"""Small models with one fault each, the expected error, and what OpenSim 4.6 does (measured).

Each model is a pendulum `a` on the pin `q` and a slider `s` that carries `b`; a case adds elements
to it. `tests/oracle/test_lint_verdicts.py` compares the verdicts with OpenSim.
"""

from __future__ import annotations

from html import escape
from typing import NamedTuple

RUNS, FAILS = "runs", "fails"
"""Verdicts of OpenSim: RUNS if all accelerations are finite, FAILS if it rejects the model or computes NaN."""


class Case(NamedTuple):
    """Model with its expected error and OpenSim's verdict."""

    name: str
    text: str
    code: str  # of the expected error, empty for none
    verdict: str  # of OpenSim, RUNS or FAILS


def small_model(
    *,
    forces: str = "",
    coordinate: str = "",
    constraints: str = "",
    controllers: str = "",
    bodies: str = "",
    joints: str = "",
    geometry: str = "",
    children: str = "",
    extra: str = "",
) -> str:
    """Return the text of the pendulum with additional elements in its sets."""
    return f"""<?xml version="1.0"?><OpenSimDocument Version="40600"><Model name="m">
<BodySet name="bodyset"><objects>
<Body name="a"><mass>1</mass><inertia>0.1 0.1 0.1 0 0 0</inertia>{children}</Body>
<Body name="b"><mass>1</mass><inertia>0.1 0.1 0.1 0 0 0</inertia></Body>{bodies}
</objects></BodySet><JointSet name="jointset"><objects>
<PinJoint name="j"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>c</socket_child_frame><coordinates><Coordinate name="q">
<default_value>0.3</default_value><range>-2 2</range>{coordinate}</Coordinate></coordinates>
<frames><PhysicalOffsetFrame name="c"><socket_parent>/bodyset/a</socket_parent>
<translation>0 0.3 0</translation></PhysicalOffsetFrame></frames></PinJoint>
<SliderJoint name="k"><socket_parent_frame>/bodyset/a</socket_parent_frame>
<socket_child_frame>/bodyset/b</socket_child_frame><coordinates><Coordinate name="s">
<default_value>0.2</default_value><range>-2 2</range></Coordinate></coordinates></SliderJoint>
{joints}</objects></JointSet>
<ConstraintSet name="constraintset"><objects>{constraints}</objects></ConstraintSet>
<ForceSet name="forceset"><objects>{forces}</objects></ForceSet>
<ContactGeometrySet name="contactgeometryset"><objects>{geometry}</objects></ContactGeometrySet>
<ControllerSet name="controllerset"><objects>{controllers}</objects></ControllerSet>
{extra}</Model></OpenSimDocument>
"""


def path_of(*points: tuple[str, str]) -> str:
    """Return the GeometryPath through points, each given by a frame and a location."""
    inside = "".join(
        f'<PathPoint name="p{number}"><socket_parent_frame>{frame}</socket_parent_frame>'
        f"<location>{place}</location></PathPoint>"
        for number, (frame, place) in enumerate(points)
    )
    return f'<GeometryPath name="path"><PathPointSet><objects>{inside}</objects></PathPointSet></GeometryPath>'


def prescribed(function: str, more: str = "") -> str:
    """Return the text of a model whose coordinate `q` follows a function."""
    inside = f"<prescribed_function>{function}</prescribed_function>"
    return small_model(coordinate=f"{more}<prescribed>true</prescribed>{inside}")


def _tag(name: str, **properties: object) -> str:
    inside = "".join(f"<{key}>{value}</{key}>" for key, value in properties.items())
    return f'<{name} name="f">{inside}</{name}>'


# Paths of frames.
GROUND, A, B = "/ground", "/bodyset/a", "/bodyset/b"
LOCKED = "<locked>true</locked>"


def expressions() -> list[Case]:
    """Return formulas that OpenSim accepts, and others that it rejects."""
    cases = []
    for formula, code in (
        ("-2*q-0.1*qdot", ""),
        ("q;x=2", ""),
        ("x;x=2", ""),
        ("step(q)-q^2", ""),
        ("-2*x", "OSIM606"),
        ("q**2", "OSIM606"),
        ("power(q,2)", "OSIM606"),
        ("min(q)", "OSIM606"),
        ("2*(q", "OSIM606"),
        ("q-pi", "OSIM606"),
        ("+q", "OSIM606"),
        ("", "OSIM606"),
        ("0*x", ""),
        ("x*0+q", ""),
        ("x-x", ""),
        ("x/x", ""),
        ("x^0", ""),
        ("0^x", ""),
        ("0/x", ""),
        ("2*x-x*2", ""),
        ("(q-q)*x", ""),
        ("0*log(q-0.3)", ""),
        ("0*q/0", ""),
        ("q;y=z", ""),
        ("1*x", "OSIM606"),
        ("x*cos(0)", "OSIM606"),
        ("0*foo(x)", "OSIM606"),
        ("q;y=", "OSIM606"),
        ("1/(q-0.3)", "OSIM532"),
        ("log(q-0.3)", "OSIM532"),
        ("sqrt(q-1)", "OSIM532"),
    ):
        force = _tag("ExpressionBasedCoordinateForce", coordinate="q", expression=escape(formula))
        text = small_model(forces=force)
        cases.append(Case(f"force on q: {formula}", text, code, FAILS if code else RUNS))
    for variable, code in (("d", ""), ("ddot", ""), ("x", "OSIM606"), ("q", "OSIM606")):
        force = _tag(
            "ExpressionBasedPointToPointForce",
            body1=GROUND,
            body2=A,
            point1="1 0 0",
            expression=variable,
        )
        text = small_model(forces=force)
        cases.append(Case(f"between points: {variable}", text, code, FAILS if code else RUNS))
    for variable, code in (("theta_x", ""), ("delta_z", ""), ("theta_w", "OSIM606")):
        force = _tag(
            "ExpressionBasedBushingForce",
            socket_frame1=GROUND,
            socket_frame2=A,
            Mx_expression=variable,
        )
        text = small_model(forces=force)
        cases.append(Case(f"bushing: {variable}", text, code, FAILS if code else RUNS))
    for variables, formula, code in (
        ("x", "x", ""),
        ("x", "y", "OSIM606"),
        ("x", "sin(x", "OSIM606"),
    ):
        function = (
            f"<ExpressionBasedFunction><variables>{variables}</variables>"
            f"<expression>{formula}</expression></ExpressionBasedFunction>"
        )
        verdict = FAILS if code else RUNS
        cases.append(
            Case(f"function of {variables}: {formula}", prescribed(function), code, verdict)
        )
    force = (
        '<PrescribedForce name="p"><socket_frame>/bodyset/a</socket_frame>'
        '<FunctionSet name="forceFunctions"><objects>{}</objects></FunctionSet></PrescribedForce>'
    )
    for formula, code in (
        ("t", ""),
        ("sin(t)/(t+1)", ""),
        ("1/t", "OSIM532"),
        ("log(t)", "OSIM532"),
        ("sin(t)/t", "OSIM532"),
        ("exp(1000)", "OSIM532"),
    ):
        function = (
            '<ExpressionBasedFunction name="f"><variables>t</variables>'
            f"<expression>{formula}</expression></ExpressionBasedFunction>"
        )
        text = small_model(forces=force.format(3 * function))
        verdict = FAILS if code else RUNS
        cases.append(Case(f"prescribed force: {formula}", text, code, verdict))
    return cases


def constraints() -> list[Case]:
    """Return constraints that some pose fulfils, and others that no pose fulfils."""

    def distance(first: str, second: str, place: str, size: float) -> str:
        return _tag(
            "ConstantDistanceConstraint",
            socket_body_1=first,
            socket_body_2=second,
            location_body_2=place,
            constant_distance=size,
        )

    def coupler(function: str, independent: str, dependent: str) -> str:
        return _tag(
            "CoordinateCouplerConstraint",
            coupled_coordinates_function=f"<LinearFunction><coefficients>{function}</coefficients></LinearFunction>",
            independent_coordinate_names=independent,
            dependent_coordinate_name=dependent,
        )

    def weld(kind: str, **more: object) -> str:
        return _tag(kind, **more)

    table = (
        ("a distance on one body that holds", distance(A, A, "0 0 1", 1), "", RUNS),
        ("a distance on one body", distance(A, A, "0 0 1", 2), "OSIM422", FAILS),
        ("a distance in millimetres", distance(GROUND, A, "0 0 0", 300), "OSIM422", FAILS),
        (
            "a point on one body",
            weld("PointConstraint", socket_body_1=A, socket_body_2=A, location_body_1="1 0 0"),
            "OSIM422",
            FAILS,
        ),
        (
            "a weld of a frame with its own body",
            weld("WeldConstraint", socket_frame1=A, socket_frame2="/jointset/j/c"),
            "OSIM422",
            FAILS,
        ),
        (
            "a weld of a body with itself",
            weld("WeldConstraint", socket_frame1=A, socket_frame2=A),
            "",
            RUNS,
        ),
        ("a coupler on itself that holds", coupler("1 0", "q", "q"), "", RUNS),
        ("a coupler on itself", coupler("1 1", "q", "q"), "OSIM422", FAILS),
        ("a coupler with a coefficient too many", coupler("1 0 5", "q", "s"), "OSIM604", RUNS),
        ("a distance of zero", distance(GROUND, A, "0 0 0", 0), "OSIM206", FAILS),
    )
    cases = [
        Case(name, small_model(constraints=text), code, verdict)
        for name, text, code, verdict in table
    ]
    locked = small_model(constraints=coupler("1 1", "s", "q"), coordinate=LOCKED).replace(
        "<default_value>0.2", f"{LOCKED}<default_value>0.2"
    )
    cases.append(Case("a coupler of two locked coordinates", locked, "OSIM422", FAILS))
    clamped = small_model(
        constraints=coupler("1 3", "s", "q"), coordinate="<clamped>true</clamped>"
    ).replace("<default_value>0.2", f"{LOCKED}<default_value>0.2")
    cases.append(Case("a coupler beyond a clamp", clamped, "OSIM423", RUNS))
    beyond = prescribed("<Constant><value>5</value></Constant>", "<clamped>true</clamped>")
    cases.append(Case("a function beyond a clamp", beyond, "OSIM423", RUNS))
    return cases


def find_contradictions() -> list[Case]:
    """Return models whose properties or frames contradict each other, although each is valid alone."""
    cases = []
    for name, function, code in (
        ("equal constant", "<Constant><value>0.3</value></Constant>", ""),
        ("equal line", "<LinearFunction><coefficients>0 0.3</coefficients></LinearFunction>", ""),
        ("other constant", "<Constant><value>0.31</value></Constant>", "OSIM515"),
        ("sine", "<Sine><amplitude>0.2</amplitude></Sine>", "OSIM515"),
        ("slope", "<LinearFunction><coefficients>1 0.3</coefficients></LinearFunction>", "OSIM515"),
    ):
        verdict = FAILS if code else RUNS
        cases.append(
            Case(f"locked and prescribed: {name}", prescribed(function, LOCKED), code, verdict)
        )

    def spring(first: str, second: str, one: str, two: str, **more: object) -> str:
        sockets = {"socket_body1": first, "socket_body2": second, "point1": one, "point2": two}
        return _tag("PointToPointSpring", **more, **sockets, stiffness=10, rest_length=0.1)

    def between(kind: str, first: str, second: str, one: str, two: str, **more: object) -> str:
        bodies = (
            {"body1": first, "body2": second}
            if kind.startswith("Exp")
            else {"bodyA": first, "bodyB": second}
        )
        points = (
            {"point1": one, "point2": two}
            if kind.startswith("Exp")
            else {"pointA": one, "pointB": two}
        )
        return _tag(kind, **bodies, **points, **more)

    springy = {"resting_length": 0.1, "stiffness": 10, "dissipation": 0}

    def band(*points: tuple[str, str], kind: str = "PathSpring", off: str = "") -> str:
        inside = "".join(
            f"<{key}>{value}</{key}>" for key, value in springy.items() if kind == "PathSpring"
        )
        return f'<{kind} name="f">{off}{path_of(*points)}{inside}</{kind}>'

    zero = "0 0 0"
    table = (
        ("a spring on one body", spring(A, A, zero, "1 0 0"), "OSIM542", FAILS),
        ("a spring on ground", spring(GROUND, GROUND, zero, "1 0 0"), "OSIM542", FAILS),
        (
            "a spring on a body and its frame",
            spring(A, "/jointset/j/c", zero, zero),
            "OSIM542",
            FAILS,
        ),
        ("a spring of no length", spring(GROUND, A, zero, "0 0.3 0"), "OSIM541", FAILS),
        ("a short spring", spring(GROUND, A, zero, "0 0.300000001 0"), "", RUNS),
        (
            "a spring of no length that is off",
            spring(GROUND, A, zero, "0 0.3 0", appliesForce="false"),
            "",
            RUNS,
        ),
        (
            "an actuator on one body",
            between("PointToPointActuator", "a", "a", zero, "1 0 0"),
            "",
            RUNS,
        ),
        (
            "an actuator on one point",
            between("PointToPointActuator", "a", "a", zero, zero),
            "OSIM541",
            FAILS,
        ),
        (
            "an expression on one point",
            between("ExpressionBasedPointToPointForce", A, A, zero, zero, expression="d"),
            "OSIM541",
            FAILS,
        ),
        ("a path of no length", band((GROUND, zero), (A, "0 0.3 0")), "OSIM541", FAILS),
        ("a piece of no length", band((GROUND, zero), (A, "0 0.3 0"), (A, zero)), "OSIM541", FAILS),
        (
            "a point twice on one body",
            band((GROUND, "0 1 0"), (A, zero), (A, zero)),
            "OSIM612",
            RUNS,
        ),
        (
            "a path of no length that is off",
            band((GROUND, zero), (A, "0 0.3 0"), off="<appliesForce>false</appliesForce>"),
            "",
            RUNS,
        ),
        (
            "an actuator without a direction",
            _tag("PointActuator", body="a", direction=zero, optimal_force=1),
            "OSIM415",
            FAILS,
        ),
        (
            "a torque without an axis",
            _tag("TorqueActuator", bodyA="a", bodyB="ground", axis=zero, optimal_force=1),
            "OSIM415",
            FAILS,
        ),
        (
            "a ligament without a length",
            band((GROUND, "0 1 0"), (A, zero), kind="Blankevoort1991Ligament"),
            "OSIM206",
            FAILS,
        ),
    )
    cases += [
        Case(name, small_model(forces=text), code, verdict) for name, text, code, verdict in table
    ]
    for value in ("-1", "0"):
        force = (
            f'<Blankevoort1991Ligament name="f">{path_of((GROUND, "0 1 0"), (A, zero))}'
            f"<slack_length>{value}</slack_length></Blankevoort1991Ligament>"
        )
        cases.append(
            Case(f"a slack_length of {value}", small_model(forces=force), "OSIM206", FAILS)
        )
    return cases


def cables() -> list[Case]:
    """Return paths over obstacles that OpenSim can compute, and others that it cannot."""
    sizes = {
        "ContactSphere": "<radius>0.1</radius>",
        "ContactCylinder": "<radius>0.1</radius>",
        "ContactEllipsoid": "<radii>0.1 0.1 0.12</radii>",
        "ContactTorus": "<torus_radius>0.1</torus_radius><tube_radius>0.02</tube_radius>",
        "ContactHalfSpace": "<orientation>0 0 -1.5707963267948966</orientation>",
    }

    def cable(
        kind: str,
        end: str,
        hint: str = "",
        frame: str = A,
        middle: str = "",
        force: str = "PathSpring",
    ) -> str:
        def point(name: str, base: str, place: str) -> str:
            return (
                f'<Scholz2015GeometryPathPoint name="{name}"><PathPoint name="x"><socket_parent_frame>{base}'
                f"</socket_parent_frame><location>{place}</location></PathPoint></Scholz2015GeometryPathPoint>"
            )

        def over(name: str, where: str) -> str:
            hinted = f"<contact_hint>{where}</contact_hint>" if where else ""
            return (
                f'<Scholz2015GeometryPathObstacle name="o{name}"><socket_contact_geometry>/contactgeometryset/{name}'
                f"</socket_contact_geometry>{hinted}</Scholz2015GeometryPathObstacle>"
            )

        second = (
            f'<ContactSphere name="h"><socket_frame>{A}</socket_frame><location>{middle}</location>'
        )
        second = f"{second}<radius>0.12</radius></ContactSphere>" if middle else ""
        elements = (
            point("p", GROUND, "-0.5 -0.3 0") + over("g", hint) + (over("h", "") if middle else "")
        )
        elements += point("r", A, end)
        springy = "<resting_length>0.1</resting_length><stiffness>10</stiffness><dissipation>0</dissipation>"
        forces = (
            f'<{force} name="f"><Scholz2015GeometryPath name="path"><path_elements>{elements}</path_elements>'
            f"</Scholz2015GeometryPath>{springy if force == 'PathSpring' else ''}</{force}>"
        )
        geometry = (
            f'<{kind} name="g"><socket_frame>{frame}</socket_frame>{sizes[kind]}</{kind}>{second}'
        )
        return small_model(forces=forces, geometry=geometry)

    cases = []
    for kind in sizes:
        is_plane, is_ring = kind == "ContactHalfSpace", kind == "ContactTorus"
        inside = "0.4 -0.02 0" if is_plane else "0.1 0.01 0" if is_ring else "0.05 0.02 0"
        middle = "0 0 0.2" if is_ring else "0 0 0"
        cases.append(Case(f"a path over a {kind}", cable(kind, "0.4 0.02 0"), "", RUNS))
        if not is_plane:
            cases.append(
                Case(
                    f"a hint in the middle of a {kind}",
                    cable(kind, "0.4 0.02 0", middle),
                    "OSIM534",
                    FAILS,
                )
            )
        for force in ("PathSpring", "PathActuator", "Millard2012EquilibriumMuscle"):
            cases.append(
                Case(
                    f"{force}: a point in a {kind}",
                    cable(kind, inside, force=force),
                    "OSIM534",
                    FAILS,
                )
            )
    sphere = "ContactSphere"
    # OpenSim interprets the location on an offset frame as a location on its body.
    by_offset = cable(sphere, "0.02 0.32 0", frame="/jointset/j/c")
    cases += [
        Case(
            "a point in a sphere of an offset frame",
            cable(sphere, "0.02 0.02 0", frame="/jointset/j/c"),
            "OSIM534",
            FAILS,
        ),
        Case("a point in a sphere by its offset frame", by_offset, "", RUNS),
        Case(
            "a point in the second of two obstacles",
            cable(sphere, "0.4 0.02 0", middle="0.35 0 0"),
            "OSIM534",
            FAILS,
        ),
        Case(
            "a path over two obstacles", cable(sphere, "0.4 0.02 0", middle="-0.55 0 0"), "", RUNS
        ),
    ]
    return cases


def functions() -> list[Case]:
    """Return functions that OpenSim computes in an unexpected way, and others that it rejects."""
    table = (
        ("<SimmSpline><x>0 1 2</x><y>0 1 3 4</y></SimmSpline>", "OSIM602", RUNS),
        ("<PiecewiseLinearFunction><x>1</x><y>0.3</y></PiecewiseLinearFunction>", "", RUNS),
        (
            "<PiecewiseLinearFunction><x>-1 1 1 2</x><y>0 1 3 4</y></PiecewiseLinearFunction>",
            "",
            RUNS,
        ),
        ("<GCVSpline><half_order>1</half_order><x>0 1 2</x><y>0 1 3</y></GCVSpline>", "", RUNS),
        ("<GCVSpline><x>0 1 2</x><y>0 1 3</y></GCVSpline>", "OSIM603", FAILS),
        (
            "<GCVSpline><half_order>2</half_order><x>0 1 2</x><y>0 1 3</y></GCVSpline>",
            "OSIM603",
            FAILS,
        ),
        (
            "<StepFunction><transition_start_time>1</transition_start_time>"
            "<transition_end_time>0</transition_end_time></StepFunction>",
            "",
            RUNS,
        ),
        (
            "<StepFunction><transition_start_time>1</transition_start_time>"
            "<transition_end_time>1</transition_end_time></StepFunction>",
            "OSIM209",
            FAILS,
        ),
        ("<LinearFunction><coefficients>1 2 3</coefficients></LinearFunction>", "", RUNS),
        ("<LinearFunction><coefficients>NaN 0</coefficients></LinearFunction>", "OSIM205", FAILS),
        ("<SimmSpline><x>0 1</x><y>Inf 0</y></SimmSpline>", "OSIM205", FAILS),
        ("<Constant><value>NaN</value></Constant>", "OSIM205", FAILS),
    )
    return [
        Case(function, prescribed(function), code, verdict) for function, code, verdict in table
    ]


def unused() -> list[Case]:
    """Return faults of functions and formulas in enabled and in disabled components."""
    actuator = (
        '<CoordinateActuator name="act"><appliesForce>{}</appliesForce><coordinate>q</coordinate>'
        "<optimal_force>1</optimal_force></CoordinateActuator>"
    )
    controller = (
        '<PrescribedController name="c"><enabled>{}</enabled><socket_actuators>/forceset/act</socket_actuators>'
        '<FunctionSet name="ControlFunctions"><objects>{}</objects></FunctionSet></PrescribedController>'
    )
    prescribed_force = (
        '<PrescribedForce name="p"><appliesForce>{}</appliesForce><socket_frame>/bodyset/a</socket_frame>'
        '<FunctionSet name="forceFunctions"><objects>{}</objects></FunctionSet></PrescribedForce>'
    )
    points = "<x>0 2 1 3</x><y>0 1 2 3</y></GCVSpline>"
    faults = (
        (f'<GCVSpline name="g"><half_order>2</half_order>{points}', "OSIM601"),
        (
            '<GCVSpline name="g"><half_order>2</half_order><x>0 1 2 3</x><y>0 1</y></GCVSpline>',
            "OSIM602",
        ),
        (f'<GCVSpline name="g">{points.replace("2 1", "1 2")}', "OSIM603"),
        ('<LinearFunction name="g"><coefficients></coefficients></LinearFunction>', "OSIM604"),
        ('<MultiplierFunction name="g" />', "OSIM605"),
        (
            '<ExpressionBasedFunction name="g"><variables>t</variables><expression>2*(</expression>'
            "</ExpressionBasedFunction>",
            "OSIM606",
        ),
    )
    cases = []
    for function, code in faults:
        for enabled, applied, verdict in (
            ("true", "true", FAILS),
            ("false", "true", RUNS),
            ("true", "false", FAILS),
        ):
            text = small_model(
                forces=actuator.format(applied), controllers=controller.format(enabled, function)
            )
            cases.append(
                Case(f"{code}: controller {enabled}, actuator {applied}", text, code, verdict)
            )
        for applied, verdict in (("true", FAILS), ("false", RUNS)):
            text = small_model(forces=prescribed_force.format(applied, 3 * function))
            cases.append(Case(f"{code}: force {applied}", text, code, verdict))
    length = (
        '<PathSpring name="f"><appliesForce>false</appliesForce><FunctionBasedPath name="path">'
        "<coordinate_paths>/jointset/j/q</coordinate_paths><length_function>{}</length_function></FunctionBasedPath>"
        "<resting_length>1</resting_length><stiffness>1</stiffness><dissipation>0</dissipation></PathSpring>"
    )
    # OpenSim creates the functions of such a path while it reads the file.
    for function, code in faults[:3]:
        text = small_model(forces=length.format(function))
        cases.append(Case(f"{code}: length of a path that is off", text, code, FAILS))
    for formula, applied, verdict in (
        ("1*x", "true", FAILS),
        ("1*x", "false", RUNS),
        ("2*(", "false", FAILS),
    ):
        force = _tag(
            "ExpressionBasedCoordinateForce",
            appliesForce=applied,
            coordinate="q",
            expression=formula,
        )
        cases.append(
            Case(f"{formula}: force {applied}", small_model(forces=force), "OSIM606", verdict)
        )
    return cases


def texts() -> list[Case]:
    """Return values in CDATA sections, and processing instructions and comments next to values."""

    def section(text: str) -> str:
        return f"<![CDATA[{text}]]>"

    spring = _tag("SpringGeneralizedForce", coordinate="q", stiffness=1)
    plain = small_model(forces=spring)
    table = (
        ("a mass in a section", "<mass>1<", f"<mass>{section('1')}<", "", RUNS),
        (
            "a mass in two sections",
            "<mass>1<",
            f"<mass>{section('1')}{section('')}<",
            "OSIM107",
            FAILS,
        ),
        ("a mass before a section", "<mass>1<", f"<mass>1{section(' ')}<", "OSIM107", FAILS),
        (
            "a mass with blanks in a section",
            "<mass>1<",
            f"<mass>{section(' 1 ')}<",
            "OSIM107",
            FAILS,
        ),
        (
            "a name with a blank in a section",
            "<coordinate>q<",
            f"<coordinate>{section(' q')}<",
            "OSIM107",
            FAILS,
        ),
        (
            "a path with blanks in a section",
            f"<socket_parent_frame>{A}<",
            f"<socket_parent_frame>{section(f' {A} ')}<",
            "OSIM107",
            FAILS,
        ),
        (
            "a path in a section",
            f"<socket_parent_frame>{A}<",
            f"<socket_parent_frame> {section(A)} <",
            "",
            RUNS,
        ),
        (
            "text that nobody reads",
            "<mass>1</mass>",
            f"<mass>1</mass>{section('x')}{section('y')}",
            "",
            RUNS,
        ),
        ("an instruction in a list", "<range>-2 2<", "<range>-2<?x y?> 2<", "OSIM107", FAILS),
        ("an instruction before a value", "<mass>1<", "<mass><?x y?>1<", "", RUNS),
    )
    return [
        Case(name, plain.replace(old, new, 1), code, verdict)
        for name, old, new, code, verdict in table
    ]


def frames() -> list[Case]:
    """Return frames that depend on each other in cycles."""

    def frame(name: str, parent: str) -> str:
        return f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent></PhysicalOffsetFrame>'

    def extra(*frames: str) -> str:
        return (
            f'<ComponentSet name="componentset"><objects>{"".join(frames)}</objects></ComponentSet>'
        )

    of_joint = small_model().replace(f"<socket_parent>{A}<", "<socket_parent>/jointset/j/c<")
    return [
        Case(
            "a frame on itself",
            small_model(extra=extra(frame("x", "/componentset/x"))),
            "OSIM411",
            FAILS,
        ),
        Case(
            "two frames on each other",
            small_model(extra=extra(frame("x", "/componentset/y"), frame("y", "/componentset/x"))),
            "OSIM411",
            FAILS,
        ),
        Case("a frame of a joint on itself", of_joint, "OSIM411", FAILS),
    ]


def poses() -> list[Case]:
    """Return joints in singular poses, and bodies without mass."""

    def joint(kind: str, angle: str) -> str:
        return small_model(
            joints=f'<{kind} name="st"><socket_parent_frame>/ground</socket_parent_frame>'
            f'<socket_child_frame>/bodyset/d</socket_child_frame><coordinates><Coordinate name="x"/>'
            f'<Coordinate name="y"><default_value>{angle}</default_value></Coordinate>'
            f'<Coordinate name="z"/></coordinates></{kind}>',
            bodies='<Body name="d"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>',
        )

    between = small_model(
        bodies='<Body name="d"><mass>0</mass><inertia>0 0 0 0 0 0</inertia></Body>'
        '<Body name="e"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>',
        joints="".join(
            f'<PinJoint name="{name}"><socket_parent_frame>{parent}</socket_parent_frame>'
            f"<socket_child_frame>/bodyset/{child}</socket_child_frame><coordinates>"
            f'<Coordinate name="{name}q"/></coordinates></PinJoint>'
            for name, parent, child in (("u", GROUND, "d"), ("v", "/bodyset/d", "e"))
        ),
    )
    return [
        Case(
            "a gimbal at 90 degrees", joint("GimbalJoint", "1.5707963267948966"), "OSIM416", FAILS
        ),
        Case("a ball at 90 degrees", joint("BallJoint", "1.5707963267948966"), "", RUNS),
        Case("a ball at -90 degrees", joint("BallJoint", "-1.5707963267948966"), "", RUNS),
        Case("a ball at 270 degrees", joint("BallJoint", "4.71238898038469"), "", RUNS),
        Case("a ball at -450 degrees", joint("BallJoint", "-7.853981633974483"), "", RUNS),
        Case("a gimbal at 1.57", joint("GimbalJoint", "1.57"), "", RUNS),
        Case("a massless body between parallel axes", between, "OSIM424", FAILS),
    ]


def others() -> list[Case]:
    """Return forces and controllers in the wrong place."""
    motor = '<CoordinateActuator name="m"><coordinate>q</coordinate></CoordinateActuator>'

    def reflex(more: str = "") -> str:
        return (
            f'<ToyReflexController name="r">{more}<socket_actuators>/forceset/m</socket_actuators>'
            "<gain>1</gain></ToyReflexController>"
        )

    disabled = "<enabled>false</enabled>"
    return [
        Case(
            "an external force", small_model(forces='<ExternalForce name="e"/>'), "OSIM543", FAILS
        ),
        Case(
            "an external force that is off",
            small_model(
                forces='<ExternalForce name="e"><appliesForce>false</appliesForce></ExternalForce>'
            ),
            "OSIM543",
            FAILS,
        ),
        Case(
            "a reflex on a motor", small_model(forces=motor, controllers=reflex()), "OSIM544", FAILS
        ),
        Case(
            "a reflex that is off",
            small_model(forces=motor, controllers=reflex(disabled)),
            "OSIM544",
            FAILS,
        ),
        Case(
            "a correction without states",
            small_model(controllers='<CorrectionController name="c"/>'),
            "OSIM531",
            FAILS,
        ),
        Case(
            "a correction that is off",
            small_model(
                controllers=f'<CorrectionController name="c">{disabled}</CorrectionController>'
            ),
            "",
            RUNS,
        ),
        Case(
            "a class after 4.6",
            small_model(forces='<CoordinateLinearStopForce name="x"/>'),
            "OSIM113",
            FAILS,
        ),
    ]


def magnitudes() -> list[Case]:
    """Return numbers that are too large or too small for OpenSim's computations."""

    def muscle(kind: str, **more: object) -> str:
        sizes = {"max_isometric_force": 100, "optimal_fiber_length": 0.1}
        inside = "".join(
            f"<{key}>{value}</{key}>"
            for key, value in {**sizes, "tendon_slack_length": 0.15, **more}.items()
        )
        path = path_of((GROUND, "0.05 0.5 0"), (A, "0.05 0 0"))
        return small_model(forces=f'<{kind} name="f">{path}{inside}</{kind}>')

    def stop(**more: object) -> str:
        sizes = {"upper_limit": 120, "lower_limit": -30, "transition": 10}
        return small_model(forces=_tag("CoordinateLimitForce", coordinate="q", **{**sizes, **more}))

    thelen, millard, degroote = (
        "Thelen2003Muscle",
        "Millard2012EquilibriumMuscle",
        "DeGrooteFregly2016Muscle",
    )
    table = [
        ("a transition that is lost beside a limit", stop(transition=1e-20), "OSIM206", FAILS),
        ("a limit beside which the transition is lost", stop(upper_limit=1e20), "OSIM206", FAILS),
        ("a lower limit beside which it is lost", stop(lower_limit=-1e20), "OSIM206", FAILS),
        ("a transition that is just seen", stop(transition=1e-12), "", RUNS),
        ("a large limit", stop(upper_limit=1e16), "", RUNS),
        (
            "gravity whose square is infinite",
            small_model(extra="<gravity>0 -1e200 0</gravity>"),
            "OSIM207",
            FAILS,
        ),
        ("little gravity", small_model(extra="<gravity>0 -1e-200 0</gravity>"), "", RUNS),
        (
            "a tendon too short to count",
            muscle(millard, tendon_slack_length=1e-200),
            "OSIM207",
            FAILS,
        ),
        (
            "fibers too short to count",
            muscle(millard, optimal_fiber_length="1e-320"),
            "OSIM207",
            FAILS,
        ),
        ("short fibers", muscle(millard, optimal_fiber_length="1e-8"), "OSIM207", FAILS),
        ("shorter fibers", muscle(millard, optimal_fiber_length="1e-30"), "OSIM207", FAILS),
        (
            "short fibers of an undamped muscle",
            muscle(millard, optimal_fiber_length="1e-8", fiber_damping="0"),
            "",
            RUNS,
        ),
        ("a tendon without end", muscle(degroote, tendon_slack_length="1e308"), "OSIM207", FAILS),
        ("fibers that are too stiff", muscle(degroote, fiber_damping="1e308"), "OSIM207", FAILS),
    ]
    for kind in (thelen, millard):
        for what in ("activation_time_constant", "deactivation_time_constant"):
            table += [
                (
                    f"{kind}: {what} below OpenSim's least",
                    muscle(kind, **{what: 2e-14}),
                    "OSIM206",
                    FAILS,
                ),
                (f"{kind}: {what} above it", muscle(kind, **{what: 2.1e-14}), "", RUNS),
            ]
    return [Case(*row) for row in table]


def not_a_number_unused() -> list[Case]:
    """Return NaN in enabled and in disabled components."""
    forces: dict[str, dict[str, object]] = {
        "SpringGeneralizedForce": {"coordinate": "q", "stiffness": "NaN"},
        "PointToPointSpring": {
            "socket_body1": GROUND,
            "socket_body2": A,
            "point1": "1 0 0",
            "stiffness": "NaN",
            "rest_length": 0.1,
        },
        "BushingForce": {
            "socket_frame1": GROUND,
            "socket_frame2": A,
            "rotational_stiffness": "NaN 1 1",
        },
        "CoordinateActuator": {"coordinate": "q", "optimal_force": "NaN"},
    }
    cases = []
    for kind, properties in forces.items():
        for applied, verdict in (("true", FAILS), ("false", RUNS)):
            text = small_model(forces=_tag(kind, appliesForce=applied, **properties))
            cases.append(Case(f"NaN in {kind}, applied {applied}", text, "OSIM205", verdict))
    path = path_of((GROUND, "0.05 0.5 0"), (A, "0.05 0 0"))
    springy = (
        "<resting_length>NaN</resting_length><stiffness>1</stiffness><dissipation>0</dissipation>"
    )
    spring = f'<PathSpring name="f"><appliesForce>false</appliesForce>{path}{springy}</PathSpring>'
    cases.append(
        Case("NaN that OpenSim refuses even so", small_model(forces=spring), "OSIM205", FAILS)
    )
    actuator = '<CoordinateActuator name="act"><coordinate>q</coordinate></CoordinateActuator>'
    for function, refused in (
        ('<Constant name="g"><value>NaN</value></Constant>', False),
        ('<Sine name="g"><amplitude>Inf</amplitude></Sine>', False),
        ('<LinearFunction name="g"><coefficients>NaN 0</coefficients></LinearFunction>', True),
    ):
        for enabled in ("true", "false"):
            controller = (
                f'<PrescribedController name="c"><enabled>{enabled}</enabled>'
                "<socket_actuators>/forceset/act</socket_actuators>"
                f'<FunctionSet name="ControlFunctions"><objects>{function}</objects></FunctionSet>'
                "</PrescribedController>"
            )
            verdict = FAILS if refused or enabled == "true" else RUNS
            text = small_model(forces=actuator, controllers=controller)
            cases.append(Case(f"{function}, enabled {enabled}", text, "OSIM205", verdict))
    return cases


OLD_TEXT = """<?xml version="1.0"?><OpenSimDocument Version="30000"><Model name="m"><gravity>0 -9.8 0</gravity>
<BodySet><objects><Body name="ground"><mass>0</mass><Joint/></Body><Body name="b"><mass>1</mass>
<mass_center>0 0 0</mass_center><inertia_xx>1</inertia_xx><inertia_yy>1</inertia_yy>
<inertia_zz>1</inertia_zz><Joint><PinJoint name="j"><parent_body>ground</parent_body>
<CoordinateSet><objects><Coordinate name="COORDINATE"/></objects></CoordinateSet></PinJoint></Joint>
</Body></objects></BodySet><ForceSet><objects>FORCES</objects>GROUPS</ForceSet>
<ControllerSet><objects>CONTROLLERS</objects></ControllerSet>
<ContactGeometrySet><objects>GEOMETRY</objects></ContactGeometrySet>
<ProbeSet><objects>PROBES</objects></ProbeSet></Model></OpenSimDocument>
"""
"""Pendulum in the format of OpenSim 3, with placeholders for more elements."""


def old_names() -> list[Case]:
    """Return old models with a blank in a name; OpenSim removes it from the name but not from references."""

    def old(name: str, verdict: str, **places: str) -> Case:
        text = OLD_TEXT
        for place in ("COORDINATE", "FORCES", "GROUPS", "CONTROLLERS", "GEOMETRY", "PROBES"):
            text = text.replace(place, places.get(place, "q" if place == "COORDINATE" else ""))
        code = "OSIM312" if verdict == FAILS else ""
        return Case(f"blank in an old name: {name}", text, code, verdict)

    def drive(name: str, coordinate: str = "q", more: str = "") -> str:
        inside = f"{more}<coordinate>{coordinate}</coordinate>"
        return f'<CoordinateActuator name="{name}">{inside}</CoordinateActuator>'

    def control(tag: str, actuators: str) -> str:
        functions = (
            '<ControlFunctions><FunctionSet name="f"><objects><Constant name="x"><value>1</value>'
            "</Constant></objects></FunctionSet></ControlFunctions>"
        )
        more = functions if tag == "PrescribedController" else ""
        return f'<{tag} name="c"><actuator_list>{actuators}</actuator_list>{more}</{tag}>'

    disabled = "<isDisabled>true</isDisabled>"
    shapes = (
        '<ContactSphere name="a s"><body_name>b</body_name><radius>0.1</radius></ContactSphere>'
        '<ContactHalfSpace name="h"><body_name>ground</body_name></ContactHalfSpace>'
    )
    parameters = "HuntCrossleyForce::ContactParameters"
    contact = (
        f'<HuntCrossleyForce name="t"><{parameters}Set><objects><{parameters}><geometry>a s h'
        f"</geometry><stiffness>1e5</stiffness></{parameters}></objects></{parameters}Set>"
        "</HuntCrossleyForce>"
    )
    limit = '<CoordinateLimitForce name="l"><coordinate>a q</coordinate></CoordinateLimitForce>'
    probe = '<ActuatorPowerProbe name="p"><actuator_names>a t</actuator_names></ActuatorPowerProbe>'
    group = '<groups><ObjectGroup name="g"><members>a t</members></ObjectGroup></groups>'
    prescribed_control = control("PrescribedController", "a t")
    control_of_set = control("ControlSetController", "a t")
    return [
        old("used by an actuator", FAILS, COORDINATE="a q", FORCES=drive("t", "a q")),
        old("used while off", FAILS, COORDINATE="a q", FORCES=drive("t", "a q", disabled)),
        old("used by a limit", FAILS, COORDINATE="a q", FORCES=limit),
        old("used by a probe", FAILS, FORCES=drive("a t"), PROBES=probe),
        old("used by a controller", FAILS, FORCES=drive("a t"), CONTROLLERS=prescribed_control),
        old("used by a contact", FAILS, GEOMETRY=shapes, FORCES=contact),
        old("used by a group", RUNS, FORCES=drive("a t"), GROUPS=group),
        old("used by a set of controls", RUNS, FORCES=drive("a t"), CONTROLLERS=control_of_set),
        old("used as OpenSim writes it", RUNS, COORDINATE="a q", FORCES=drive("t", "aq")),
        old("used by nobody", RUNS, COORDINATE="a q"),
        old("at the beginning", RUNS, COORDINATE=" aq", FORCES=drive("t", "aq")),
        old("at the ends of name and reference", RUNS, COORDINATE="aq ", FORCES=drive("t", " aq")),
    ]


CASES = [
    *expressions(),
    *constraints(),
    *find_contradictions(),
    *cables(),
    *functions(),
    *unused(),
    *texts(),
    *frames(),
    *poses(),
    *others(),
    *magnitudes(),
    *not_a_number_unused(),
    *old_names(),
]
"""All cases."""
