"""Single faults in a correct pipeline, each of which was tried with OpenSim 4.6.

The numbers refer to the table of faults (``oracle/tools/setup_faults.json`` of the reference data).
It says what OpenSim does with each fault: it raises an exception, crashes, hangs, logs a line, or
computes other results without a message.
"""

from __future__ import annotations

import gzip
import re
from pathlib import Path
from typing import NamedTuple

SETUPS = Path(__file__).resolve().parents[2] / "fixtures" / "setups"
TEXTS = {file.name: file.read_text() for file in sorted(SETUPS.iterdir()) if file.suffix != ".gz"}
TEXTS["model.osim"] = gzip.decompress((SETUPS / "model.osim.gz").read_bytes()).decode()


class Fault(NamedTuple):
    """Fault that replaces one text of a file by another.

    A finding is expected in the file `found_in` (default: the changed file), on the line with the
    text `line_of` (default: the changed line). The values ``first``, ``second:R.ASIS`` and
    ``NumMarkers-values`` of `line_of` name certain lines, see `test_setup_faults.py`. The changes
    `also` to other files are made first.
    """

    number: int | str  # number in the table of faults, or a name for a fault outside of it
    file: str
    old: str  # text to be replaced once; "every:" before it replaces all occurrences
    new: str
    found_in: str = ""
    line_of: str = ""
    also: tuple[tuple[str, str, str], ...] = ()  # file, old text and new text of further changes


def line(name: str, beginning: str) -> str:
    """Return the first line of a file that begins with a text."""
    return next(row for row in TEXTS[name].splitlines() if row.lstrip().startswith(beginning))


def rows(name: str) -> list[str]:
    """Return the data rows of a table."""
    return [row for row in TEXTS[name].splitlines() if row[:1].isdigit()][name == "walk.trc" :]


def cell(name: str, row: int, column: int, new: str) -> tuple[str, str, str]:
    """Replace one cell of a table.

    Returns:
        File, old text and new text, as in `Fault.also`.
    """
    old = rows(name)[row]
    cells = old.split("\t")
    return name, f"\n{old}\n", "\n" + "\t".join([*cells[:column], new, *cells[column + 1 :]]) + "\n"


def without(name: str, *beginnings: str) -> tuple[str, str, str]:
    """Remove a line of a file.

    Returns:
        File, old text and new text, as in `Fault.also`.
    """
    return name, line(name, beginnings[0]) + "\n", ""


def part(name: str, pattern: str) -> str:
    """Return the first match of a pattern in a file."""
    return next(re.finditer(pattern, TEXTS[name], re.DOTALL))[0]


def unseen(row: int, new: str) -> tuple[str, str, str]:
    """Replace the second marker in a row of the marker file.

    Returns:
        File, old text and new text, as in `Fault.also`.
    """
    cells = rows("walk.trc")[row].split("\t")
    return "walk.trc", "\t".join(cells), "\t".join([*cells[:5], new, new, new, *cells[8:]])


def swapped(one: str, other: str) -> str:
    """Return the line of marker labels with two labels exchanged."""
    labels = TEXTS["walk.trc"].splitlines()[3].split("\t")
    return "\t".join({one: other, other: one}.get(label, label) for label in labels)


# Rows and pieces of the files of the pipeline, to which the faults below refer.
TRC = rows("walk.trc")
COORDS = rows("coords.mot")
HEAD = TEXTS["walk.trc"].splitlines()
LABELS = line("coords.mot", "time")
MANY = "\n".join(COORDS)
TASK = '<IKMarkerTask name="R.ASIS">\n\t\t\t\t\t<apply>true</apply>\n\t\t\t\t\t<weight>3</weight>'
COORDINATE_TASK = part("ik.xml", r"<IKCoordinateTask.*?</IKCoordinateTask>")
ANALYSES = part("so.xml", r"<objects>\n.*</objects>(?=\n\t\t</AnalysisSet>)")
PLACER = part(
    "scale.xml",
    r"<marker_file>walk.trc</marker_file>\s*<time_range>0.5 0.6</time_range>\s*<output_m\w*>pl",
)
KINEMATICS = part("so.xml", r"<Kinematics .*?</Kinematics>")
CONTROLLER = '<PrescribedController name="c"><socket_actuators>/forceset/nosuch</socket_actuators></PrescribedController>'
PAIR = part("scale.xml", r"<MarkerPair name.*?</MarkerPair>")

VALUE = '<MocoVariableInfo name="/slider/position/value"'


def parameter(path: str, name: str, element: int | None = None) -> str:
    """Return a MocoParameter and the beginning of the goals after it."""
    more = "" if element is None else f"<property_element>{element}</property_element>"
    return (
        '<parameters><MocoParameter name="p"><MocoBounds><bounds>1 3</bounds></MocoBounds>'
        f"<component_paths>{path}</component_paths><property_name>{name}</property_name>{more}"
        "</MocoParameter></parameters><goals>"
    )


def pair(kind: str, first: str, last: str) -> str:
    """Return a periodicity goal for two variables."""
    return (
        f'<MocoPeriodicityGoal name="o"><{kind}_pairs><MocoPeriodicityGoalPair><initial_variable>{first}'
        f"</initial_variable><final_variable>{last}</final_variable></MocoPeriodicityGoalPair></{kind}_pairs>"
        "</MocoPeriodicityGoal></goals>"
    )


def constraint(tag: str, text: str) -> str:
    """Return a path constraint that follows the goals of a study."""
    return f'</goals><path_constraints><{tag} name="d">{text}</{tag}></path_constraints>'


PATHS = re.sub(r"(?<=\t)(\w+)", r"/jointset/j/\1/value", LABELS)
BARE = re.sub(r"</?OpenSimDocument.*\n", "", TEXTS["ik.xml"])
# Marker file whose first marker is NaN in all frames.
NEVER_SEEN = re.sub(r"(?m)^(\d+\t[\d.]+)(\t[^\t]*){3}", r"\1\tNaN\tNaN\tNaN", TEXTS["walk.trc"])
# Setup of inverse kinematics with only three markers.
TOO_FEW = re.sub(
    r"(<IK\w+Task name=\"(?!Sternum|R.ASIS|L.ASIS)[^>]*>\s*<apply>)true",
    r"\1false",
    TEXTS["ik.xml"],
)
STATES = "\n".join(
    ["states", "version=1", "nRows=61", "nColumns=11", "inDegrees=no", "endheader", LABELS, *COORDS]
)
PRESCRIBED = """<OpenSimDocument Version="30000"><ForceSet name="loads"><objects>
    <PrescribedForce name="push"><body>calcn_r</body></PrescribedForce>
</objects></ForceSet></OpenSimDocument>"""

KNEE, HIP = (
    part("model.osim", f'<Coordinate name="{name}">.*?</Coordinate>')
    for name in ("knee_angle_r", "hip_flexion_l")
)
CLAMPED = KNEE.replace("<clamped>false", "<clamped>true").replace(
    "-2.0943950999999998 0.17453293", "0 0.01"
)
LOCKED = KNEE.replace("<locked>false", "<locked>true")
MARKERS = part("model.osim", "<MarkerSet .*?</MarkerSet>")
GROUPS = part("model.osim", r"<groups />\s*</ForceSet>")
GROUPED = (
    '<groups><ObjectGroup name="some"><members>soleus_r</members></ObjectGroup></groups></ForceSet>'
)

FAULTS = [
    # Setups of any tool
    Fault(1, "ik.xml", "every:InverseKinematicsTool", "AnalyzeTool"),
    Fault(5, "ik.xml", 'Version="40600"', 'Version="20201"', "", "<InverseKinematicsTool"),
    Fault(0, "ik.xml", "<InverseKinematicsTool>", "<InverseKinemtaticsTool>"),
    Fault(4, "ik.xml", 'Version="40600"', 'Version="four"'),
    Fault(6, "ik.xml", "<accuracy>1e-005</accuracy>", "<acuracy>1e-005</acuracy>"),
    Fault(7, "ik.xml", "<accuracy>1e-005</accuracy>", "<accuracy>1e-005</accuracy>\n<accuracy>0.001</accuracy>",
          "", "0.001"),
    Fault(8, "ik.xml", "<accuracy>1e-005", "<accuracy>high"),
    Fault(9, "ik.xml", "<accuracy>1e-005", "<accuracy>"),
    Fault(10, "ik.xml", "<accuracy>1e-005", "<accuracy>1e-5abc"),
    Fault(11, "ik.xml", "<report_errors>true", "<report_errors>yes"),
    Fault(12, "ik.xml", "<time_range>0.5 1", "<time_range>0.5"),
    Fault(13, "ik.xml", "<time_range>0.5 1", "<time_range>0.5 0.6 1"),
    Fault(14, "id.xml", "<time_range>0.5 1", "<time_range>0.5"),
    Fault(15, "id.xml", "coordinates>6<", "coordinates>six<"),
    Fault(16, "id.xml", "<coordinates_file>", "<coords_in_degrees>true</coords_in_degrees>\n<coordinates_file>"),
    Fault(17, "ik.xml", "</accuracy>", "", "", "</InverseKinematicsTool"),
    # Inverse kinematics
    Fault(20, "ik.xml", "model.osim", "nomodel.osim"),
    Fault(21, "ik.xml", "<marker_file>walk.trc", "<marker_file>nomarkers.trc"),
    Fault(22, "ik.xml", "<marker_file>walk.trc", "<marker_file>"),
    Fault(23, "ik.xml", "<marker_file>walk.trc", "<marker_file>reserves.txt"),
    Fault(24, "ik.xml", "<coordinate_file>coords.mot", "<coordinate_file>nocoords.mot"),
    Fault(25, "ik.xml", "<coordinate_file>coords.mot", "<coordinate_file>Unassigned", "", "from_file"),
    Fault(26, "coords.mot", "\tknee_angle_r\t", "\tknee_r\t", "ik.xml", 'IKCoordinateTask name="knee_angle_r"'),
    Fault(27, "coords.mot", "\n".join(COORDS[:45]) + "\n", "", "ik.xml", "<time_range>"),
    Fault(28, "ik.xml", 'MarkerTask name="Sternum"', 'MarkerTask name="Nowhere"'),
    Fault(29, "walk.trc", "\tSternum\t", "\tSternumX\t", "ik.xml", 'name="Sternum"'),
    Fault(30, "model.osim", '<Marker name="Sternum">', '<Marker name="SternumX">', "ik.xml", 'name="Sternum"'),
    Fault(31, "walk.trc", HEAD[3], re.sub(r"\t(\w[^\t]*)(?=\t\t\t|\t*$)", r"\tS1:\1", HEAD[3]), "ik.xml",
          "<marker_file>"),
    Fault(32, "ik.xml", TASK, f"{TASK}\n</IKMarkerTask>\n{TASK.replace('3', '20')}", "", "second:R.ASIS"),
    Fault("sides swapped", "walk.trc", HEAD[3], swapped("R.Heel", "L.Heel"), "ik.xml", 'name="R.Heel"'),
    Fault(33, "ik.xml", "<weight>3<", "<weight>-3<"),
    Fault(34, "ik.xml", "<weight>3<", "<weight>0<"),
    Fault(35, "ik.xml", "<weight>3<", "<weight>NaN<"),
    Fault(36, "ik.xml", "every:<apply>true", "<apply>false", "", "<IKTaskSet>"),
    Fault(37, "ik.xml", '"pelvis_tilt"', '"pelvis_tillt"'),
    Fault(38, "ik.xml", '"lumbar_extension"', '"lumbar_ext"'),
    Fault(39, "ik.xml", "<value_type>manual_value", "<value_type>by_hand"),
    Fault(40, "ik.xml", "manual_value</value_type>\n\t\t\t\t\t<value>0",
          "manual_value</value_type>\n\t\t\t\t\t<value>10"),
    Fault(41, "ik.xml", '"lumbar_extension"', '"pelvis_tilt"'),
    Fault(42, "ik.xml", COORDINATE_TASK, COORDINATE_TASK.replace("IKCoord", "IKCord")),
    Fault(43, "ik.xml", "<IKTaskSet>", '<IKTaskSet file="tasks.xml">'),
    Fault(44, "ik.xml", "<time_range>0.5 1", "<time_range>0 99"),
    Fault(45, "ik.xml", "<time_range>0.5 1", "<time_range>50 99"),
    Fault(46, "ik.xml", "<time_range>0.5 1", "<time_range>1 0.5"),
    Fault(47, "ik.xml", "<time_range>0.5 1", "<time_range>NaN 1"),
    Fault(48, "ik.xml", "<accuracy>1e-005", "<accuracy>0"),
    Fault(49, "ik.xml", "<accuracy>1e-005", "<accuracy>0.5"),
    Fault(50, "ik.xml", "<accuracy>1e-005", "<accuracy>-1"),
    Fault(51, "ik.xml", "<constraint_weight>Inf", "<constraint_weight>-1"),
    Fault(53, "ik.xml", "<results_directory>./", "<results_directory>not/there"),
    Fault(54, "ik.xml", "<output_motion_file>ik_out.mot", "<output_motion_file>nothere/ik_out.mot"),
    Fault(55, "ik.xml", "<output_motion_file>ik_out.mot", "<output_motion_file>"),
    Fault(56, "ik.xml", "model.osim", "model.osim", "", 'IKCoordinateTask name="knee_angle_r"',
          (("model.osim", KNEE, CLAMPED),)),
    Fault(282, "ik.xml", "model.osim", "model.osim", "", 'IKCoordinateTask name="knee_angle_r"',
          (("model.osim", KNEE, LOCKED),)),
    Fault(283, "ik.xml", "model.osim", "model.osim", "", "<coordinate_file>",
          (("model.osim", HIP, HIP.replace("<locked>false", "<locked>true")),)),
    Fault(284, "ik.xml", TEXTS["ik.xml"], TOO_FEW, "", "<IKTaskSet>"),
    # Markers
    Fault(77, "walk.trc", TEXTS["walk.trc"], NEVER_SEEN, "", "Frame#"),
    Fault(57, "walk.trc", "\tmm\t", "\tm\t"),
    Fault(58, "walk.trc", "\tmm\t", "\t\t"),
    Fault(59, "walk.trc", "\tmm\t", "\tmillimetres\t"),
    Fault(60, "walk.trc", "\tmm\t", "\tcm\t"),
    Fault(61, "walk.trc", f"\t{len(TRC)}\t41", "\t999\t41"),
    Fault(62, "walk.trc", f"\t{len(TRC)}\t41", "\t10\t41"),
    Fault(63, "walk.trc", "\t41\tmm", "\t40\tmm"),
    Fault(64, "walk.trc", "\t41\tmm", "\t42\tmm"),
    Fault(65, "walk.trc", "\t41\tmm", "\tmany\tmm"),
    Fault(66, "walk.trc", "\n60.00\t", "\nfast\t"),
    Fault(67, "walk.trc", "\n60.00\t", "\n0\t"),
    Fault(68, "walk.trc", "\tNumMarkers\t", "\tNumMarker\t"),
    Fault(69, "walk.trc", "\tOrigNumFrames", "", "", "DataRate"),
    Fault(72, "walk.trc", "every:\n", "\r", "", "first"),
    Fault(73, "walk.trc", TRC[4], TRC[4].replace("\t", " ")),
    Fault(75, *cell("walk.trc", 4, 5, "")),
    Fault(78, "walk.trc", TRC[4], "\t".join([*TRC[4].split("\t")[:5], "0", "0", "0", *TRC[4].split("\t")[8:]])),
    Fault(79, *cell("walk.trc", 4, 5, "abc")),
    Fault(80, *cell("walk.trc", 4, 1, "0,533")),
    Fault(81, "walk.trc", TRC[4], TRC[4].rpartition("\t")[0]),
    Fault(82, "walk.trc", TRC[4], TRC[4] + "\t5.0"),
    Fault(83, *cell("walk.trc", 4, 0, "1")),
    Fault(84, *cell("walk.trc", 4, 0, "x")),
    Fault(85, *cell("walk.trc", 4, 1, TRC[3].split("\t")[1])),
    Fault(86, *cell("walk.trc", 4, 1, "0.2")),
    Fault(87, *cell("walk.trc", 4, 1, "NaN")),
    Fault(88, "walk.trc", "\tL.ASIS\t", "\tR.ASIS\t"),
    Fault(89, "walk.trc", "\tL.ASIS\t", "\t\t", "", "NumMarkers-values"),
    Fault(90, "walk.trc", "\tR.ASIS\t", "\tR ASIS\t"),
    Fault(91, "walk.trc", HEAD[4] + "\n", ""),
    Fault(92, "walk.trc", "every:\t\n|\n", "\t\t\n", "", TRC[0][:20]),
    Fault(93, "walk.trc", "PathFileType", "\ufeffPathFileType"),
    Fault(94, "walk.trc", "PathFileType", "PathFile"),
    Fault(95, "walk.trc", "".join(TEXTS["walk.trc"]), ""),
    Fault(96, "walk.trc", "\n".join(TRC) + "\n", "", "", "Frame#"),
    Fault(97, "walk.trc", TRC[4], "\n" + TRC[4]),
    # Storage files
    Fault(98, "id.xml", "coords.mot", "nocoords.mot"),
    Fault(99, *without("coords.mot", "inDegrees"), "id.xml", "<coordinates_file>"),
    Fault(100, "coords.mot", "inDegrees=yes", "inDegrees=no", "id.xml", "<coordinates_file>"),
    Fault(101, "coords.mot", "inDegrees=yes", "inDegrees=true"),
    Fault(103, "coords.mot", "inDegrees=yes", "indegrees=yes"),
    Fault(104, "coords.mot", "nRows=61", "nRows=99"),
    Fault(105, "coords.mot", "nRows=61", "nRows=30"),
    Fault(106, *without("coords.mot", "nRows"), "", "endheader"),
    Fault(107, "coords.mot", "nColumns=11", "nColumns=10"),
    Fault(108, "coords.mot", "nColumns=11", "nColumns=12"),
    Fault(109, *without("coords.mot", "nColumns"), "", "endheader"),
    Fault(110, *without("coords.mot", "endheader"), "", "time"),
    Fault(111, "coords.mot", "endheader", "ENDHEADER"),
    Fault(115, "coords.mot", "\thip_flexion_l", "\thip_flexion_r"),
    Fault(116, "coords.mot", "\thip_flexion_l", "\thip_flexon_l", "id.xml", "<coordinates_file>"),
    Fault(117, "coords.mot", LABELS, LABELS.replace("\t", "\t/jointset/j/"), "id.xml", "<coordinates_file>"),
    Fault(118, "coords.mot", "\thip_flexion_l", "", "", "nColumns"),
    Fault(119, "coords.mot", "time\t", "Time\t"),
    Fault(120, "coords.mot", "time\t", "t\t"),
    Fault(121, *cell("coords.mot", 9, 3, "NaN")),
    Fault(122, *cell("coords.mot", 9, 3, "abc")),
    Fault(123, "coords.mot", COORDS[9], COORDS[9].rpartition("\t")[0]),
    Fault(124, "coords.mot", COORDS[9], COORDS[9] + "\t5"),
    Fault(125, *cell("coords.mot", 9, 0, COORDS[8].split("\t")[0])),
    Fault(126, *cell("coords.mot", 9, 0, "0.01")),
    Fault(127, "coords.mot", "\n".join(COORDS[9:15]) + "\n", ""),
    Fault(130, "coords.mot", "".join(TEXTS["coords.mot"]), "", "", "first"),
    Fault(131, "coords.mot", MANY, "", "", "time"),
    Fault(133, "coords.mot", "every:\t", ",", "", "time"),
    Fault(134, "coords.mot", COORDS[9], "\n" + COORDS[9]),
    Fault(135, "coords.mot", COORDS[9], "# remark\n" + COORDS[9]),
    # External loads
    Fault(136, "id.xml", "loads.xml", "nogrf.xml"),
    Fault(138, "id.xml", "loads.xml", "reserves.xml"),
    Fault(139, "loads.xml", "grf.mot", "nogrf.mot"),
    Fault(140, "loads.xml", "grf.mot", ""),
    Fault(141, "loads.xml", ">calcn_r<", ">calcn_right<"),
    Fault(142, "loads.xml", ">calcn_r<", "><"),
    Fault(145, "loads.xml", "expressed_in_body>ground", "expressed_in_body>grund"),
    Fault(146, "loads.xml", "<point_expressed_in_body>ground", "<point_expressed_in_body>grund"),
    Fault(147, "loads.xml", ">ground_force_v<", ">grnd_force_v<"),
    Fault(148, "loads.xml", ">ground_force_v<", "><"),
    Fault(149, "loads.xml", ">ground_force_v<", ">ground_force_<"),
    Fault(150, "loads.xml", ">ground_force_p<", ">ground_force_q<"),
    Fault(151, "loads.xml", ">ground_force_p<", "><"),
    Fault(152, "loads.xml", ">ground_torque_<", ">ground_trq_<"),
    Fault(154, "grf.mot", "\tground_force_vz", "\tground_fz", "loads.xml", ">ground_force_v<"),
    Fault(155, "grf.mot", "ground_force_vx\tground_force_vy", "ground_force_vy\tground_force_vx", "loads.xml",
          ">ground_force_v<"),
    Fault(157, "grf.mot", "\n".join(rows("grf.mot")[40:]) + "\n", "", "id.xml", "<external_loads_file>"),
    Fault(158, "grf.mot", "\n".join(rows("grf.mot")[:40]) + "\n", "", "id.xml", "<external_loads_file>"),
    Fault(159, *cell("grf.mot", 9, 13, "NaN")),
    Fault(160, "loads.xml", "<isDisabled>false", "<isDisabled>true"),
    Fault(161, "loads.xml", 'name="left"', 'name="right"'),
    Fault(144, "loads.xml", ">calcn_l<", ">calcn_r<"),
    Fault("feet swapped", "loads.xml", ">calcn_r<", ">calcn_l<"),
    Fault("points of ground", "loads.xml", "<point_expressed_in_body>ground", "<point_expressed_in_body>calcn_r", "",
          "calcn_r<"),
    Fault("forces of ground", "loads.xml", "<force_expressed_in_body>ground", "<force_expressed_in_body>calcn_r"),
    Fault(287, "loads.xml", ">1_ground_force_p<", "><"),
    Fault(289, "grf.mot", "1_ground_force_vx\t1_ground_force_vy", "1_ground_force_vy\t1_ground_force_vx",
          "loads.xml", ">1_ground_force_v<"),
    Fault(290, "loads.xml", ">1_ground_force_v<", ">1_ground_force_w<"),
    Fault(292, "loads.xml", ">ground_force_v<", ">GROUND_FORCE_V<"),
    Fault(293, *cell("grf.mot", 9, 2, "NaN")),
    Fault(294, "grf.mot", "\tground_force_vy", "\tground_force_vx"),
    Fault(296, "loads.xml", "grf.mot", ".\\grf.mot"),
    Fault(297, "loads.xml", "grf.mot", "sub/grf.mot"),
    Fault(298, "loads.xml", "applied_to_body>calcn_r</applied_to_body", "aplied_to_body>calcn_r</aplied_to_body"),
    Fault(299, "loads.xml", ">calcn_r<", ">femur_l_offset<"),
    # Inverse dynamics
    Fault(137, "id.xml", ">loads.xml<", ">Unassigned<"),
    Fault(166, "id.xml", "> Muscles<", ">soleus_r<", also=(("model.osim", GROUPS, GROUPED),)),
    Fault(177, "id.xml", ">Results<", ">/proc/nowhere<"),
    Fault(162, "id.xml", "model.osim", "nomodel.osim"),
    Fault(163, "id.xml", "> Muscles<", ">nosuch<"),
    Fault(164, "id.xml", "> Muscles<", "><"),
    Fault(300, "id.xml", "> Muscles<", ">hamstring_r<"),
    Fault(167, "id.xml", "coords.mot", ""),
    Fault(168, "coords.mot", "\thip_flexion_l", "\tsomething", "id.xml", "<coordinates_file>"),
    Fault(169, "coords.mot", LABELS, LABELS.replace("\t", "\tx_"), "id.xml", "<coordinates_file>"),
    Fault(170, "id.xml", "<time_range>0.5 1", "<time_range>0.5 99"),
    Fault(171, "id.xml", "<time_range>0.5 1", "<time_range>50 99"),
    Fault(172, "id.xml", "<time_range>0.5 1", "<time_range>1 0.5"),
    Fault(173, "id.xml", "coordinates>6<", "coordinates>100<"),
    Fault(174, "id.xml", "coordinates>6<", "coordinates>0<"),
    Fault(175, "id.xml", ">ALL</joints", ">nosuch</joints"),
    Fault(176, "id.xml", ">ALL</joints", ">nosuch /jointset/hip_r</joints"),
    Fault(178, "id.xml", ">subject01_walk_ID.sto<", "><"),
    Fault(179, "id.xml", ">subject01_walk_ID.sto<", ">out/id.sto<"),
    Fault(302, "coords.mot", LABELS, LABELS.replace("\t", "\t/jointset/j/"), "id.xml", "<coordinates_file>"),
    # Analyses
    Fault(184, "so.xml", ">reserves.xml<", "><", "", "<StaticOptimization"),
    Fault(206, "so.xml", ">loads.xml<", "><"),
    Fault(209, "so.xml", "coordinates>6<", "coordinates>-1<"),
    Fault(220, "so.xml", "<point_name>knee", "<point_name>"),
    Fault(231, "so.xml", "states>true<", "states>false<"),
    Fault(331, "loads.xml", TEXTS["loads.xml"], PRESCRIBED, "so.xml", "<external_loads_file>"),
    Fault(306, "forward.xml", "<states_file />", "<states_file>coords.mot</states_file>",
          also=(("coords.mot", TEXTS["coords.mot"], STATES),)),
    Fault(180, "so.xml", ">reserves.xml<", ">noreserve.xml<"),
    Fault(181, "reserves.xml", "<coordinate>hip_flexion_r<", "<coordinate>hip_flexion_rx<"),
    Fault(182, "reserves.xml", "<body>pelvis<", "<body>pelvus<"),
    Fault(185, "so.xml", ">reserves.xml<", ">loads.xml<"),
    Fault(186, "so.xml", "<replace_force_set>false", "<replace_force_set>true"),
    Fault(187, "so.xml", "coords.mot", "nocoords.mot"),
    Fault(188, "so.xml", "<coordinates_file>coords.mot", "<coordinates_file>"),
    Fault(189, "coords.mot", "\tlumbar_extension", "\tsomething", "so.xml", "<coordinates_file>"),
    Fault(190, "coords.mot", "inDegrees=yes", "inDegrees=no", "so.xml", "<coordinates_file>"),
    Fault(191, "so.xml", "<states_file />", "<states_file>coords.mot</states_file>", "", "<coordinates_file>"),
    Fault(192, "so.xml", "<speeds_file />", "<speeds_file>nosp.sto</speeds_file>"),
    Fault(193, "so.xml", "<initial_time>0.5", "<initial_time>5", "", "<final_time>"),
    Fault(194, "so.xml", "<final_time>1", "<final_time>99"),
    Fault(195, "so.xml", ANALYSES, "<objects />", "", "<AnalyzeTool"),
    Fault(196, "so.xml", "every:StaticOptimization", "StaticOptimisation"),
    Fault(197, "so.xml", "<on>true", "<on>false"),
    Fault(198, "so.xml", "exponent>2", "exponent>1"),
    Fault(199, "so.xml", "exponent>2", "exponent>-2"),
    Fault(200, "so.xml", "iterations>100", "iterations>1"),
    Fault(201, "so.xml", ">0.0001<", ">0.5<"),
    Fault(202, "so.xml", "interval>1", "interval>0"),
    Fault(203, "so.xml", "interval>1", "interval>-1"),
    Fault(204, "so.xml", "<use_model_force_set>true", "<use_model_force_set>false"),
    Fault(205, "so.xml", "loads.xml", "nogrf.xml"),
    Fault(207, "so.xml", "model.osim", "nomodel.osim"),
    Fault(208, "so.xml", "model.osim", ""),
    Fault(210, "so.xml", "<objects />",
          "<objects><ControlSetController name='c'><controls_file>no.xml</controls_file></ControlSetController>"
          "</objects>"),
    Fault(212, "so.xml", "<bodies>all", "<bodies>tibia_r nosuch"),
    Fault(213, "so.xml", "<bodies>all", "<bodies>nosuch"),
    Fault(214, "so.xml", "<bodies>all", "<bodies>"),
    Fault(215, "so.xml", "<bodies>all", "<bodies>ALL"),
    Fault(216, "so.xml", "<coordinates>knee_angle_r", "<coordinates>nosuch"),
    Fault(217, "so.xml", "<coordinates>knee_angle_r", "<coordinates>"),
    Fault(218, "so.xml", "<body_name>tibia_r", "<body_name>nosuch"),
    Fault(219, "so.xml", "body_name>none", "body_name>nosuch"),
    Fault(221, "so.xml", "<muscle_list>all", "<muscle_list>nosuch"),
    Fault(222, "so.xml", "list>all</moment", "list>nosuch</moment"),
    Fault(224, "so.xml", "<joint_names>ALL", "<joint_names>nosuch"),
    Fault(225, "so.xml", "bodies>child", "bodies>kid"),
    Fault(226, "so.xml", "bodies>child", "bodies>child parent"),
    Fault(227, "so.xml", "frame>ground", "frame>nosuch"),
    Fault(228, "so.xml", "<forces_file>Unassigned", "<forces_file>noforces.sto"),
    Fault(229, "so.xml", "<start_time>0.5", "<start_time>5", "", "<end_time>"),
    Fault(230, "so.xml", 'name="Kinematics"', 'name="BodyKinematics"', "", 'BodyKinematics name="BodyKinematics"'),
    Fault(304, "so.xml", "<results_directory>results", "<results_directory>not/there"),
    Fault(305, "so.xml", ">reserves.xml<", ">reserves.xml other.xml<"),
    # Scaling
    Fault(234, "scale.xml", "markers.xml", "Unassigned", also=(("model.osim", MARKERS, ""),)),
    Fault(255, "scale.xml", "<mass>72.6", "<mass>-1"),
    Fault(232, "scale.xml", "model.osim", "nomodel.osim"),
    Fault(233, "scale.xml", "markers.xml", "nomarkers.xml"),
    Fault(235, "markers.xml", "/bodyset/torso", "/bodyset/trunk"),
    Fault(236, "scale.xml", "<markers>R.ASIS L.ASIS", "<markers>R.ASIS L.ASYS"),
    Fault(249, *unseen(4, "NaN"), "scale.xml", "R.ASIS L.ASIS"),
    Fault(250, *unseen(4, ""), "scale.xml", "R.ASIS L.ASIS"),
    Fault("factor", "scale.xml", "<scales>1 1 1", "<scales>1 10 1"),
    Fault(237, "scale.xml", "<markers>R.ASIS L.ASIS", "<markers>R.ASIS"),
    Fault(238, "scale.xml", "<markers>R.ASIS L.ASIS", "<markers>R.ASIS R.ASIS"),
    Fault(239, "walk.trc", "\tTop.Head\t", "\tTopHead\t", "scale.xml", "V.Sacral Top.Head"),
    Fault(240, "scale.xml", 'BodyScale name="torso"', 'BodyScale name="trunk"'),
    Fault(241, "scale.xml", "<axes>X Y Z", "<axes>X Y W"),
    Fault(242, "scale.xml", "<scaling_order>measurements", "<scaling_order>measurement"),
    Fault(243, "scale.xml", "measurements manualScale", "manualScale measurements"),
    Fault(244, "scale.xml", "<marker_file>walk.trc", "<marker_file>nostatic.trc"),
    Fault(245, "scale.xml", "<marker_file>walk.trc", "<marker_file>Unassigned"),
    Fault(247, "walk.trc", "\tmm\t", "\tm\t"),
    Fault(248, "walk.trc", "\tmm\t", "\tinches\t"),
    Fault(251, "scale.xml", "<time_range>0.5 0.6", "<time_range>50 60"),
    Fault(252, "scale.xml", "<time_range>0.5 0.6", "<time_range>0.6 0.5"),
    Fault(253, "scale.xml", "<time_range>0.5 0.6", "<time_range>0.5"),
    Fault(254, "scale.xml", "every:<time_range>0.5 0.6", "<time_range>-1 -1"),
    Fault(256, "scale.xml", "<mass>72.6", "<mass>0"),
    Fault(257, "scale.xml", "<mass>72.6", "<mass>NaN"),
    Fault(259, "scale.xml", 'IKMarkerTask name="R.ASIS"', 'IKMarkerTask name="R.ASYS"'),
    Fault(260, "scale.xml", '"lumbar_extension"', '"lumbarext"'),
    Fault(261, "scale.xml", "<MarkerPlacer>\n\t\t\t<apply>true", "<MarkerPlacer>\n\t\t\t<apply>false"),
    Fault(262, "scale.xml", "<ModelScaler>\n\t\t\t<apply>true", "<ModelScaler>\n\t\t\t<apply>false"),
    Fault(263, "scale.xml", PAIR, "", "", 'Measurement name="torso"'),
    Fault(264, "scale.xml", "<segment>calcn_r", "<segment>foot_r"),
    Fault(265, "scale.xml", ">placed.osim<", ">Unassigned<"),
    # Forward
    Fault(266, "forward.xml", "<states_file />", "<states_file>noinit.sto</states_file>"),
    Fault(269, "forward.xml", "controls.xml", "nocontrols.xml"),
    Fault(270, "controls.xml", "hamstrings_r.excitation", "nosuch.excitation"),
    Fault(272, "forward.xml", "<enabled>true", "<enabled>false"),
    Fault(273, "forward.xml", "<final_time>0.1", "<final_time>-1"),
    Fault(274, "forward.xml", "tolerance>0.00001", "tolerance>0"),
    Fault(275, "forward.xml", "steps>20000", "steps>1"),
    Fault(276, "forward.xml", "<states_file />", "<states_file />\n<use_specified_dt>true</use_specified_dt>", "",
          "use_specified_dt"),
    Fault(277, "ik.xml", "model.osim", ""),
    Fault(278, "ik.xml", "model.osim", "Unassigned"),
    Fault(279, "ik.xml", "model.osim", ".\\model.osim"),
    Fault(280, "ik.xml", "model.osim", "MODEL.osim"),
    Fault(132, "coords.mot", "\n".join(COORDS[2:]) + "\n", "", "id.xml", "<coordinates_file>"),
    Fault(183, "reserves.xml", 'name="hip_flexion_r_reserve"', 'name="hamstrings_r"'),
    Fault(211, "so.xml", "<objects />", f"<objects>{CONTROLLER}</objects>"),
    Fault(246, "scale.xml", PLACER, PLACER.replace("walk.trc", "nostatic.trc")),
    Fault(268, "forward.xml", "<states_file />", "<states_file>grf.mot</states_file>"),
    Fault(271, "forward.xml", "<enabled>true", "<socket_actuators>/forceset/nosuch</socket_actuators>\n<enabled>true"),
    Fault(286, "ik.xml", "<results_directory>./", "<results_directory>out", "", "<output_motion_file>"),
    Fault(330, "so.xml", KINEMATICS, KINEMATICS.replace("Kinematics", "InverseDynamics")),
    Fault(285, "coords.mot", "inDegrees=yes", "inDegrees=no", "id.xml", "<coordinates_file>"),
    # Studies of Moco
    Fault(307, "slide.omoco", "slide.osim", "noslide.osim"),
    Fault(308, "slide.omoco", VALUE, VALUE.replace("position", "pos")),
    Fault(309, "slide.omoco", "<bounds>-5 5", "<bounds>5 -5"),
    Fault(310, "slide.omoco", "</state_infos>", f"{VALUE} />\n</state_infos>"),
    Fault(311, "slide.omoco", '"/actuator"', '"/aktuator"'),
    Fault(312, "slide.omoco", '"/actuator"', '"actuator"'),
    Fault(313, "slide.omoco", "every:MocoFinalTimeGoal", "MocoFinishGoal"),
    Fault(314, "slide.omoco", "<filepath>slide_states.sto", "<filepath>", "", "<MocoStateTrackingGoal"),
    Fault(315, "slide.omoco", "slide_states.sto", "noref.sto"),
    Fault(316, "slide.omoco", 'MocoWeight name="/actuator"', 'MocoWeight name="/nosuch"'),
    Fault(317, "slide.omoco", '<MocoFinalTimeGoal name="time">', '<MocoFinalTimeGoal name="time"><wait>1</wait>'),
    Fault(318, "slide.omoco", "<verbosity>", "<transcription_scheme>euler</transcription_scheme><verbosity>"),
    Fault(319, "slide.omoco", "slide_guess.sto", "noguess.sto"),
    Fault(320, "slide.omoco", "intervals>10", "intervals>-1"),
    Fault(321, "slide.omoco", "<verbosity>", "<optim_solver>knitro</optim_solver><verbosity>"),
    Fault(322, "slide.omoco", "<bounds>0 5", "<bounds>-3 -2"),
    Fault(323, "slide.omoco", "<bounds>-5 5", "<bounds>-5 0 5"),
    Fault(324, "slide.omoco", "every:MocoStudy", "MocoStudie"),
]  # fmt: skip
"""Faults that the linter finds, by their numbers in the table."""

STUDIES = [
    Fault("bounds at the start", "slide.omoco", "<initial_bounds>0", "<initial_bounds>7"),
    Fault("name of a goal twice", "slide.omoco", 'name="effort"', 'name="time"'),
    Fault("no name of a goal", "slide.omoco", ' name="effort"', ""),
    Fault("weight of a state", "slide.omoco", 'MocoWeight name="/slider/position', 'MocoWeight name="/slider/pos'),
    Fault("column of a reference", "slide_states.sto", "position/speed", "position/sped", "slide.omoco",
          "<filepath>slide_states.sto"),
    Fault("state of a guess", "slide_guess.sto", "position/speed", "position/sped", "slide.omoco", "<guess_file>"),
    Fault("control of a guess", "slide_guess.sto", "\t/actuator", "\t/aktuator", "slide.omoco", "<guess_file>"),
    Fault("broken pattern", "slide.omoco", "<goals>", '<state_infos_pattern><MocoVariableInfo name="/x(/">'
          "<bounds>0 1</bounds></MocoVariableInfo></state_infos_pattern><goals>"),
    Fault("pattern of a goal", "slide.omoco", "<weight>0.01<", "<pattern>nosuch</pattern><weight>0.01<"),
    Fault("locked coordinate", "slide.osim", '<Coordinate name="position">',
          '<Coordinate name="position"><locked>true</locked>', "slide.omoco", "<filepath>slide.osim"),
    Fault("free joint", "slide.osim", "</components>", '<Body name="b"><mass>1</mass><inertia>1 1 1 0 0 0</inertia>'
          '</Body><FreeJoint name="f"><socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/b'
          "</socket_child_frame></FreeJoint></components>", "slide.omoco", "<filepath>slide.osim"),
    Fault("property of a parameter", "slide.omoco", "<goals>", parameter("/body", "masss")),
    Fault("component of a parameter", "slide.omoco", "<goals>", parameter("/bdy", "mass")),
    Fault("element of a parameter", "slide.omoco", "<goals>", parameter("/body", "mass_center")),
    Fault("element of a number", "slide.omoco", "<goals>", parameter("/body", "mass", 0)),
    Fault("parameter that is a switch", "slide.omoco", "<goals>", parameter("/slider/position", "clamped", 0)),
    Fault("output", "slide.omoco", "</goals>", '<MocoOutputGoal name="o"><output_path>/body|positin</output_path>'
          "</MocoOutputGoal></goals>"),
    Fault("joint", "slide.omoco", "</goals>", '<MocoJointReactionGoal name="o"><joint_path>/no</joint_path>'
          "</MocoJointReactionGoal></goals>"),
    Fault("measure", "slide.omoco", "</goals>", '<MocoJointReactionGoal name="o"><joint_path>/slider</joint_path>'
          "<reaction_measures>force-q</reaction_measures></MocoJointReactionGoal></goals>"),
    Fault("pair of states", "slide.omoco", "</goals>", pair("state", "/slider/pos/value", "/slider/position/value")),
    Fault("pair of controls", "slide.omoco", "</goals>", pair("control", "/slider/position/value", "/actuator")),
    Fault("point", "slide.omoco", "</goals>", '<MocoMarkerFinalGoal name="o"><point_name>/no</point_name>'
          "</MocoMarkerFinalGoal></goals>"),
    Fault("frame", "slide.omoco", "</goals>", constraint("MocoFrameDistanceConstraint", "<frame_pairs>"
          "<MocoFrameDistanceConstraintPair><frame1_path>/no</frame1_path><frame2_path>/body</frame2_path>"
          "</MocoFrameDistanceConstraintPair></frame_pairs>")),
    Fault("control with bounds", "slide.omoco", "</goals>", constraint("MocoControlBoundConstraint",
          "<control_paths>/no</control_paths><lower_bound><Constant /></lower_bound>")),
    Fault("state with bounds", "slide.omoco", "</goals>", constraint("MocoStateBoundConstraint",
          "<state_paths>/no</state_paths><lower_bound><Constant /></lower_bound>")),
    Fault("mode", "slide.omoco", "<weight>0.001<", "<mode>costs</mode><weight>0.001<"),
    Fault("exponent", "slide.omoco", "<weight>0.001<", "<exponent>1</exponent><weight>0.001<"),
]  # fmt: skip
"""Further faults for which OpenSim rejects a study."""

HARMLESS = [
    Fault(
        "known actuator",
        "forward.xml",
        "<enabled>true",
        "<socket_actuators>/forceset/hamstrings_r</socket_actuators>\n<enabled>true",
    ),
    Fault(2, "ik.xml", TEXTS["ik.xml"], BARE),
    Fault(3, "ik.xml", 'Version="40600"', 'Version="40000"'),
    Fault(153, "loads.xml", ">ground_torque_<", "><"),
    Fault(156, "loads.xml", "<data_source_name>Unassigned", "<data_source_name>other.mot"),
    Fault(165, "id.xml", "> Muscles<", ">ALL<"),
    Fault(241, "scale.xml", "<axes>X Y Z", "<axes>x Y z"),
    Fault(223, "so.xml", "list>all</moment", "list> all </moment"),
    Fault(288, "loads.xml", ">1_ground_torque_<", "><"),
    Fault(291, "loads.xml", ">ground_force_v<", "> ground_force_v <"),
    Fault(295, "grf.mot", "inDegrees=yes", "inDegrees=no"),
    Fault(301, "id.xml", "> Muscles<", ">some<", also=(("model.osim", GROUPS, GROUPED),)),
    Fault(303, "coords.mot", LABELS, PATHS, "so.xml"),
    Fault(281, "ik.xml", "model.osim", "./model.osim"),
    Fault(327, "so.xml", "coords.mot", "./coords.mot"),
    Fault(18, "ik.xml", "<IKTaskSet>", "<!-- Z\u00fcrich --><IKTaskSet>"),
    Fault(52, "ik.xml", "<constraint_weight>Inf", "<constraint_weight>20"),
    Fault(70, "walk.trc", f"\n\n{TRC[0]}", f"\n{TRC[0]}"),
    Fault(71, "walk.trc", "every:\n", "\r\n"),
    Fault(74, *unseen(20, "")),
    Fault(76, *unseen(20, "NaN")),
    Fault(102, "coords.mot", "inDegrees=yes", "inDegrees = yes"),
    Fault(112, *without("coords.mot", "version")),
    Fault(113, "coords.mot", "version=1", "version=3"),
    Fault(114, "coords.mot", "nRows=61\nnColumns=11", "datarows 61\ndatacolumns 11"),
    Fault(128, "coords.mot", "every:\n", "\r\n"),
    Fault(129, "coords.mot", "Coordinates", "\ufeffCoordinates"),
    Fault(143, "loads.xml", ">calcn_r<", ">/bodyset/calcn_r<"),
    Fault(
        258, "scale.xml", "<preserve_mass_distribution>true", "<preserve_mass_distribution>false"
    ),
]
"""Changes that OpenSim accepts with the same results, or that the user may choose.

In fault 301 the forces of a group are disabled.
"""

UNTOLD = {
    19: "there is no file; the program says so",
    267: "no file says that the motion was to start elsewhere than in the default pose of the model",
    325: "the folder that OpenSim runs in is another",
    326: "the folder that OpenSim runs in is another",
    328: "the folder that OpenSim runs in is another",
    329: "the folder that OpenSim runs in is another",
}
"""Faults that cannot be seen in the files, and why."""


def put_in(folder: Path, fault: Fault) -> int:
    """Write a fault into its files and return the number of the changed line."""
    for name, old, new in fault.also:
        text = (folder / name).read_text()
        assert old in text, f"'{old}' is not in {name}"
        (folder / name).write_text(text.replace(old, new, 1))
    path = folder / fault.file
    text = path.read_bytes().decode()
    if fault.number == 92:
        changed = re.sub(r"(?m)^(\d+\t.*)$", r"\1\t\t", text)
    elif "every:" in fault.old:
        changed = text.replace(fault.old.removeprefix("every:"), fault.new)
    else:
        assert fault.old in text, f"'{fault.old[:60]}' is not in {fault.file}"
        changed = text.replace(fault.old, fault.new, 1)
    path.write_bytes(changed.encode())
    before, after = text.split("\n"), changed.split("\n")
    return next(
        (k for k, pair in enumerate(zip(before, after, strict=False), 1) if pair[0] != pair[1]), 1
    )
