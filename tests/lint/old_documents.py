"""Documents of old versions; most have content on which OpenSim's own upgrade fails."""

from __future__ import annotations

POINTS = "".join(
    f'<{kind} name="p{n}"><location>0 {n} 0</location><body>ball</body>{more}</{kind}>'
    for n, (kind, more) in enumerate(
        [
            ("PathPoint", ""),
            ("ConditionalPathPoint", "<coordinate>turn</coordinate><range>-1 1</range>"),
            ("PathPoint", ""),
        ]
    )
)
# Document of version 30000, whose joints are inside of bodies.
OLD = f"""<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="30000"><Model name="old"><BodySet><objects>
<Body name="ground"><mass>0</mass><Joint/></Body>
<Body name="ball"><mass>1</mass><mass_center>0 0 0</mass_center>
<inertia_xx>1</inertia_xx><inertia_yy>1</inertia_yy><inertia_zz>1</inertia_zz>
<Joint><CustomJoint name="hinge"><parent_body>ground</parent_body>
<location_in_parent>0 0 0</location_in_parent><orientation_in_parent>0 0 0</orientation_in_parent>
<CoordinateSet><objects><Coordinate name="turn"><motion_type>rotational</motion_type></Coordinate></objects>
</CoordinateSet><SpatialTransform><TransformAxis name="rotation1"><coordinates>turn</coordinates><axis>0 0 1</axis>
<function><LinearFunction><coefficients>1 0</coefficients></LinearFunction></function></TransformAxis>
<TransformAxis name="rotation2"><axis>0 1 0</axis><function><Constant><value>0</value></Constant></function>
</TransformAxis>
<TransformAxis name="rotation3"><axis>1 0 0</axis><function><Constant><value>0</value></Constant></function>
</TransformAxis>
</SpatialTransform></CustomJoint></Joint>
<VisibleObject><scale_factors>1 1 1</scale_factors><transform>0 0 0 0 0 0</transform><GeometrySet><objects>
<DisplayGeometry><geometry_file>a.vtp</geometry_file><transform>0 0 0 1 0 0</transform>
<display_preference>4</display_preference>
</DisplayGeometry></objects></GeometrySet></VisibleObject>
<WrapObjectSet><objects><WrapSphere name="skin"><radius>0.1</radius><display_preference>3</display_preference>
</WrapSphere></objects></WrapObjectSet></Body>
</objects></BodySet><ForceSet><objects>
<Thelen2003Muscle name="pull"><min_control>0</min_control><GeometryPath>
<PathPointSet><objects>{POINTS}</objects></PathPointSet>
<VisibleObject><display_preference>1</display_preference></VisibleObject></GeometryPath>
<optimal_fiber_length>0.1</optimal_fiber_length><pennation_angle_at_optimal>0.2</pennation_angle_at_optimal>
</Thelen2003Muscle>
</objects></ForceSet></Model></OpenSimDocument>
"""
# Document of version 30502, between the formats of OpenSim 3 and 4.
YEARS_BETWEEN = """<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="30502"><Model name="m"><Ground name="ground"/><BodySet><objects>
<Body name="ball"><mass>1</mass><mass_center>0 0 0</mass_center><inertia>1 1 1 0 0 0</inertia></Body>
</objects></BodySet><JointSet><objects><WeldJoint name="weld"><connectors>
<Connector_PhysicalFrame_ name="parent_frame"><connectee_name>ground</connectee_name></Connector_PhysicalFrame_>
<Connector_PhysicalFrame_ name="child_frame"><connectee_name>ball</connectee_name></Connector_PhysicalFrame_>
</connectors></WeldJoint></objects></JointSet></Model></OpenSimDocument>
"""
PARENT = '<Connector_PhysicalFrame_ name="parent_frame"><connectee_name>ground</connectee_name></Connector_PhysicalFrame_>'

VECTORS = (
    *(
        "1 1 1",
        "1, 1, 1",
        "1,1 1",
        "[1 1 1]",
        "~(1,1,1)",
        "1 1 1 1",
        "1 1",
        "NaN 1 1",
        "1 Inf 1",
        "1e400 1 1",
    ),
    *(
        "1e-320 1 1",
        "1. .5 +1e0",
        "1.5x 1 1",
        "a 1 1",
        "",
        "1,,1 1",
        "{1 1 1}",
        "[1 1 1",
        "1 1e 1",
        "<!-- a -->1 1 1",
    ),
    *("1 <!-- a --> 1 1", "<x/>", "1 1 1<x/>"),
)
# Texts for an integer property, several of them invalid.
ACCELERATION_STAGE = (
    "4",
    "0",
    "-7",
    "+3",
    " 2 ",
    "3.0",
    "1e1",
    "abc",
    "",
    "4 4",
    "NaN",
    "99999999999",
    "0x3",
)
# Texts for a number, most of them invalid.
NUMBERS = (
    "abc",
    "",
    "NaN",
    "-inf",
    "1e400",
    "1e-400",
    "1,5",
    "1 2",
    "5kg",
    "5e",
    "nan nan",
    "<x/>",
)

DEFAULTS = (
    *(f"<ControlLinear><default_max>{text}</default_max></ControlLinear>" for text in NUMBERS),
    *(
        f"<CMC_Joint><weight>{text}</weight></CMC_Joint>"
        for text in (*NUMBERS, "1,5 2", "(1 2)", "1 2 a")
    ),
    *(
        f"<CMC_Joint><active>{text}</active></CMC_Joint>"
        for text in ("", "abc", "<x/>", "a<!-- b --> c")
    ),
    "<ControlLinear><x_nodes><ControlLinearNode/></x_nodes></ControlLinear>",
    "<ControlLinear><x_nodes><Body/></x_nodes></ControlLinear>",
)

# Texts for a list of numbers with various separators.
LISTS = (
    "0 1 2",
    "0,1,2",
    "0, 1 , 2",
    "(0 1 2)",
    "0,1 2",
    "0 1,2",
    "(0,1 2)",
    "0 1 2,",
    "0,,1,2",
    "0 1 5kg",
    "[0 1 2",
)

# Base document, text to be replaced and its replacement, by the name of the case.
CASES: dict[str, tuple[str, str, str]] = {
    **{
        text: (OLD, '<Model name="old">', f'<Model name="old"><defaults>{text}</defaults>')
        for text in DEFAULTS
    },
    **{
        f"list {text}": (
            OLD,
            "LinearFunction><coefficients>1 0<",
            f"SimmSpline><y>0 1 2</y><x>{text}</x><coefficients><",
        )
        for text in LISTS
    },
    **{
        f"scale {text}": (OLD, "<scale_factors>1 1 1<", f"<scale_factors>{text}<")
        for text in VECTORS
    },
    **{
        f"place {text}": (OLD, "<location_in_parent>0 0 0<", f"<location_in_parent>{text}<")
        for text in VECTORS
    },
    **{
        f"frame {text}": (OLD, "<transform>0 0 0 1 0 0<", f"<transform>{text} 1 0 0<")
        for text in VECTORS
    },
    **{
        f"shown {text}": (OLD, ">4</display_preference", f">{text}</display_preference")
        for text in ACCELERATION_STAGE
    },
    **{
        f"skin {text}": (OLD, ">3</display_preference", f">{text}</display_preference")
        for text in ACCELERATION_STAGE
    },
    **{
        f"path {text}": (OLD, ">1</display_preference", f">{text}</display_preference")
        for text in ACCELERATION_STAGE
    },
    **{f"inertia {text}": (OLD, "<inertia_yy>1<", f"<inertia_yy>{text}<") for text in NUMBERS},
    **{
        f"control {text}": (OLD, "<min_control>0<", f"<min_control>{text}<")
        for text in ("0 0", "0 1 2 3 4 5 6 7", "abc", "")
    },
    **{
        f"pennation {text}": (OLD, "optimal>0.2<", f"optimal>{text}<")
        for text in ("1e30", "1.6", "1.5707963267948961", "1.57", "0", "-0.1")
    },
    "joint missing": (OLD, "<Joint/>", ""),
    "joint of a body missing": (
        OLD,
        "</Body>\n</objects>",
        "</Body><Body name='b'><mass>1</mass></Body></objects>",
    ),
    "joint renamed": (OLD, '<Body name="ball"><mass>1', '<Body name="ball"><joint/><mass>1'),
    "no parent": (OLD, "<parent_body>ground</parent_body>", ""),
    "no bodies": (OLD, "BodySet>", "Bodyset>"),
    "no objects": (OLD, "<BodySet><objects>", "<BodySet><Objects/></BodySet><BodySet><objects>"),
    "element in a motion type": (OLD, "rotational<", "rotational<a/><"),
    "model takes the name": (OLD, '<Model name="old">', '<Model name="turn">'),
    "function takes the name": (OLD, "<Constant>", '<Constant name="turn">'),
    "body takes the name": (
        OLD,
        '<Body name="ground">',
        '<Body name="turn"><Joint/></Body><Body name="ground">',
    ),
    "axis takes the name": (OLD, '<TransformAxis name="rotation1">', '<TransformAxis name="turn">'),
    "no class as function": (OLD, "<Constant><value>0</value></Constant>", "<orientation/>"),
    "foreign class as function": (OLD, "<Constant><value>0</value></Constant>", "<Body name='c'/>"),
    "constraint among coordinates": (
        OLD,
        "<CoordinateSet><objects>",
        "<CoordinateSet><objects><WeldConstraint name='w'/>",
    ),
    "coordinate doubled": (
        OLD,
        '<Coordinate name="turn">',
        '<Coordinate name="turn"/><Coordinate name="turn">',
    ),
    "set for a coordinate": (OLD, '<Coordinate name="turn">', '<BodySet><Coordinate name="turn">'),
    "connector renamed": (
        YEARS_BETWEEN,
        PARENT,
        PARENT.replace("Connector_PhysicalFrame_", "Connector_Frame_"),
    ),
    "connector missing": (YEARS_BETWEEN, PARENT, ""),
    "connector without a name": (YEARS_BETWEEN, PARENT, PARENT.replace(' name="parent_frame"', "")),
    "connector without a connectee": (
        YEARS_BETWEEN,
        PARENT,
        PARENT.replace("connectee_name", "connectee"),
    ),
    "connector twice": (YEARS_BETWEEN, PARENT, PARENT + PARENT),
    "connector twice, first wrong": (
        YEARS_BETWEEN,
        PARENT,
        PARENT.replace(">ground<", ">nobody<") + PARENT,
    ),
    "connector twice, last wrong": (
        YEARS_BETWEEN,
        PARENT,
        PARENT + PARENT.replace(">ground<", ">nobody<"),
    ),
    "no connectors": (YEARS_BETWEEN, "connectors>", "Connectors>"),
}

# Cases that OpenSim 4.6 accepts; tests/oracle/test_lint_old_formats.py verifies this.
TAKEN = frozenset((
    "<ControlLinear><default_max>NaN</default_max></ControlLinear>",
    "<ControlLinear><default_max>-inf</default_max></ControlLinear>",
    "<ControlLinear><default_max>1e-400</default_max></ControlLinear>",
    "<ControlLinear><default_max>1,5</default_max></ControlLinear>",
    "<ControlLinear><default_max>1 2</default_max></ControlLinear>",
    "<ControlLinear><default_max>5kg</default_max></ControlLinear>",
    "<CMC_Joint><weight></weight></CMC_Joint>", "<CMC_Joint><weight>1e-400</weight></CMC_Joint>",
    "<CMC_Joint><weight>1,5</weight></CMC_Joint>", "<CMC_Joint><weight>1 2</weight></CMC_Joint>",
    "<CMC_Joint><weight>(1 2)</weight></CMC_Joint>", "<CMC_Joint><active></active></CMC_Joint>",
    "<CMC_Joint><active>abc</active></CMC_Joint>",
    "<ControlLinear><x_nodes><ControlLinearNode/></x_nodes></ControlLinear>", "list 0 1 2",
    "list 0,1,2", "list 0, 1 , 2", "list (0 1 2)", "scale 1 1 1", "scale 1, 1, 1", "scale 1,1 1",
    "scale [1 1 1]", "scale ~(1,1,1)", "scale 1e-320 1 1", "scale 1. .5 +1e0",
    "scale <!-- a -->1 1 1", "place 1 1 1", "place 1, 1, 1", "place 1,1 1", "place [1 1 1]",
    "place ~(1,1,1)", "place 1e-320 1 1", "place 1. .5 +1e0", "place <!-- a -->1 1 1",
    "frame 1 1 1", "frame 1, 1, 1", "frame 1,1 1", "frame 1e-320 1 1", "frame 1. .5 +1e0",
    "frame <!-- a -->1 1 1", "shown 4", "shown 0", "shown -7", "shown +3", "shown  2 ", "skin 4",
    "skin 0", "skin -7", "skin +3", "skin  2 ", "path 4", "path 0", "path -7", "path +3",
    "path  2 ", "inertia NaN", "inertia -inf", "inertia 1e-400", "inertia 1,5", "inertia 1 2",
    "inertia 5kg", "control 0 0", "control 0 1 2 3 4 5 6 7", "pennation 1.57", "pennation 0",
    "joint missing", "joint renamed", "no class as function", "foreign class as function",
    "constraint among coordinates", "coordinate doubled", "connector twice",
    "connector twice, first wrong",
))  # fmt: skip

# The documents without changes, and the second one in the first version whose joints are outside of
# bodies.
SOUND = OLD, YEARS_BETWEEN, YEARS_BETWEEN.replace("30502", "30501")


def make_document(case: str) -> str:
    """Return the text of a case."""
    text, old, new = CASES[case]
    assert old in text
    text = text.replace(old, new)
    if case.startswith("list "):
        text = text.replace("</LinearFunction>", "</SimmSpline>")
    if case == "set for a coordinate":
        text = text.replace("</motion_type></Coordinate>", "</motion_type></Coordinate></BodySet>")
    return text
