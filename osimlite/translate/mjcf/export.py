"""The translation of a whole model to MJCF."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from lxml.etree import Comment, _Comment, tostring
from numpy.polynomial.polynomial import polyval

from osimlite import __version__
from osimlite.base.records import dataclass, field
from osimlite.errors import SettingError
from osimlite.io.document.printer import to_text
from osimlite.io.meshes.folders import MeshFolders
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.mechanism import Values
from osimlite.schema.model import Model
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.mesh_files import MeshFiles
from osimlite.simulation.robot.names import coordinate_names, legal, xml_name
from osimlite.simulation.robot.robot import Robot
from osimlite.simulation.robot.visuals import Visuals, collect_visuals
from osimlite.translate.fidelity import Fidelity
from osimlite.translate.files import write_files
from osimlite.translate.mjcf.bodies import add_bodies, add_frames
from osimlite.translate.mjcf.constraints import add_constraints
from osimlite.translate.mjcf.contacts import add_contacts
from osimlite.translate.mjcf.coordinates import add_coordinates
from osimlite.translate.mjcf.couplings import add_couplings
from osimlite.translate.mjcf.draft import (
    Contact,
    Draft,
    Fit,
    Follower,
    Lead,
    Options,
    Spline,
    Version,
    add_element,
)
from osimlite.translate.mjcf.driven import add_driven
from osimlite.translate.mjcf.forces import add_forces
from osimlite.translate.mjcf.keyframe import add_keyframe
from osimlite.translate.mjcf.paths import add_paths
from osimlite.translate.mjcf.scenery import add_camera, add_markers, add_shapes
from osimlite.translate.mjcf.time_step import DEFAULT_STEP_S, choose_step
from osimlite.translate.survey import account_for_rest

Pass = Callable[[Draft], None]

MECHANISM_PASSES: tuple[Pass, ...] = (add_bodies, add_couplings, add_coordinates, add_constraints)
FORCE_PASSES: tuple[Pass, ...] = (add_contacts, add_paths, add_forces, choose_step)
SCENERY_PASSES: tuple[Pass, ...] = (add_shapes, add_camera, add_markers, add_frames, add_keyframe)
"""What makes a file of a model, in this order: bodies and joints come before what acts on them or is fixed to them."""


@dataclass(frozen=True)
class Mjcf:
    """A model as MJCF.

    Attributes:
        name: of the files.
        text: the MJCF.
        fidelity: what became of every component, exact where there is no record of it.
        robot: the neutral robot that was written; its joints and links have MuJoCo's names.
        files: mesh files that the text names, and what the driver needs, by name relative to it.
        followers: what equality constraints make of joints, by name.
        start_note: where simulations have to start, if that is not everywhere.
        leads: the joint that is a straight line of a coordinate, by the coordinate's place in the
            mechanism.
    """

    name: str
    text: str
    fidelity: Fidelity
    robot: Robot
    files: dict[str, bytes] = field(default_factory=dict)
    leads: Mapping[int, Lead] = field(default_factory=dict)
    followers: Mapping[str, Follower] = field(default_factory=dict)
    start_note: str = ""

    def joint_values(self, q: Values) -> dict[str, float]:
        """Values (rad, m) of all joints by name at coordinate values `q`, exact where equalities are fitted."""
        values = self.robot.mechanism.values(q)
        leads = {
            joint: line.slope * values[place] + line.start
            for place, (joint, line) in self.leads.items()
        }
        result = leads | self.robot.joint_values(values)
        for joint, follower in self.followers.items():
            if joint not in result:
                result[joint] = float(polyval(result[follower.leader or ""], follower.polynomial))
        return result

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``<name>.xml``, its meshes and ``fidelity.json`` into a folder, which is made if it is not there.

        Returns:
            The files written, the MJCF first. It is written last, when all it needs is in place.

        Raises:
            OsimliteError: a file cannot be written.
        """
        return write_files(
            Path(folder),
            {f"{self.name}.xml": self.text, **self.files, "fidelity.json": self.fidelity.to_json()},
        )


@any_numbers
def to_mjcf(
    model: Model,
    *,
    mujoco: Version = 4,
    visuals: bool = True,
    contact: Contact = "native",
    fit: Fit = "none",
    spline: Spline = "series",
    driver: bool = False,
    folder: str | Path | None = None,
    geometry: Sequence[str | Path] = (),
    name: str | None = None,
) -> Mjcf:
    """Translate a model to MJCF, without MuJoCo and without OpenSim.

    Bodies keep their names and frames. Joints are named by their coordinates, whose values are
    theirs (rad, m).

    Args:
        model: the model.
        mujoco: the version to write for, 3 or 4.
        visuals: whether to say what bodies look like.
        contact: ``"native"`` writes contact forces as contacts of MuJoCo's own law, ``"none"``
            leaves them out.
        fit: ``"wraps"`` moves and resizes what tendons go around until they do what the paths do,
            ``"force"`` fits the curves and lengths of muscles to their isometric forces too;
            ``"none"`` keeps all numbers of the model.
        spline: ``"quartic"`` fits one quartic to a function that is none, ``"series"`` a quartic of
            a quartic, which takes a helper joint for each and is about twice as close.
        driver: write the file that `osimlite.mjcf.Driver` moves, which has no forces: the driver
            computes them from the model, of which a copy is among the files.
        folder: where the model's file is; mesh files are looked for there and in its folder
            ``Geometry``.
        geometry: more folders to look for mesh files in; those in the environment variable
            OSIMLITE_GEOMETRY, separated as in PATH, follow them.
        name: of the files to write, without ending; that of the model if not given.

    Raises:
        SettingError: an option has a value that it does not take.
        ModelError: the model is not a mechanism: something it names is not there, or a body is not
            connected.
        UnsupportedError: it uses a joint or constraint that osimlite cannot compute.
    """
    if mujoco not in (3, 4):
        raise SettingError(f"MJCF is written for MuJoCo 3 or 4, not {mujoco}")
    if contact not in ("native", "none"):
        raise SettingError(f"contact is 'native' or 'none', not '{contact}'")
    if fit not in ("none", "wraps", "force"):
        raise SettingError(f"fit is 'none', 'wraps' or 'force', not '{fit}'")
    if spline not in ("quartic", "series"):
        raise SettingError(f"spline is 'quartic' or 'series', not '{spline}'")
    mechanism = build_mechanism(model)
    fidelity = Fidelity(mechanism.name, f"mjcf {mujoco}")
    place = None if folder is None else Path(folder)
    mesh_files = MeshFiles(MeshFolders(place, geometry))
    shapes = collect_visuals(model, mechanism, fidelity.add, mesh_files) if visuals else Visuals()
    robot = coordinate_names(build_robot(mechanism, visuals=shapes.by_body))
    draft = Draft(
        model,
        robot,
        fidelity,
        Options(mujoco, visuals, contact, fit, spline, driver),
        place,
        mesh_files,
    )
    _add_settings(draft)
    fidelity.translated["/"] = f"mujoco {mechanism.name}"
    for make in (*MECHANISM_PASSES, *((add_driven,) if driver else FORCE_PASSES), *SCENERY_PASSES):
        make(draft)
    account_for_rest(draft.tree, fidelity)
    for section in list(draft.root):
        if not section.attrib and not len(section) and not isinstance(section, _Comment):
            draft.root.remove(section)
    name = legal(model.name or "model") if name is None else name
    text = tostring(draft.root, pretty_print=True, xml_declaration=True, encoding="utf-8").decode()
    return Mjcf(
        name,
        text,
        fidelity,
        robot,
        mesh_files.files | ({f"{name}.osim": to_text(model).encode()} if driver else {}),
        draft.leads,
        draft.followers,
        draft.start_note,
    )


def _add_settings(draft: Draft) -> None:
    root = draft.root
    root.set("model", xml_name(draft.mechanism.name))
    root.append(Comment(f" Written by osimlite {__version__} for MuJoCo {draft.options.version}. "))
    add_element(
        root,
        "compiler",
        angle="radian",
        autolimits=True,
        inertiafromgeom=False,
        balanceinertia=False,
    )
    add_element(
        root,
        "option",
        timestep=DEFAULT_STEP_S,
        gravity=draft.mechanism.gravity,
        integrator="implicitfast",
    )
    # Two steps is the quickest that MuJoCo lets a constraint be; the nearer to 1 the impedance, the
    # less it gives way.
    add_element(
        add_element(root, "default"),
        "equality",
        solref="0.002 1",
        solimp="0.9999 0.9999 0.001 0.5 2",
    )
    # The sections in the order in which they are best read.
    for tag in ("asset", "worldbody", "contact", "equality", "tendon", "actuator", "keyframe"):
        draft.get_section(tag)
