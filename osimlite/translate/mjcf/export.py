"""Translation of a complete model to MJCF."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from lxml.etree import Comment, _Comment, tostring
from numpy.polynomial.polynomial import polyval

from osimlite import __version__
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count
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
    Fit,
    Follower,
    Lead,
    MjcfDraft,
    MjcfOptions,
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
from osimlite.translate.survey import record_dropped_components

Pass = Callable[[MjcfDraft], None]
"""Function that adds the elements of one kind of component to a draft."""

MECHANISM_PASSES: tuple[Pass, ...] = (add_bodies, add_couplings, add_coordinates, add_constraints)
"""Passes for bodies, joints and constraints; they come first, as all others refer to bodies and
joints.
"""
FORCE_PASSES: tuple[Pass, ...] = (add_contacts, add_paths, add_forces, choose_step)
"""Passes for forces with MuJoCo's laws; the driver replaces them."""
SCENERY_PASSES: tuple[Pass, ...] = (add_shapes, add_camera, add_markers, add_frames, add_keyframe)
"""Passes for what is fixed to bodies, and for the default pose, which needs all joints and
actuators.
"""


@dataclass(frozen=True)
class Mjcf:
    """Model as MJCF.

    Attributes:
        name: name of the files.
        text: MJCF text.
        fidelity: account of what became of every component; those without a record are exact.
        robot: neutral robot that was written; its joints and links have MuJoCo's names.
        files: mesh files that the text names, and files of the driver, by name relative to it.
        leads: joint that is a linear function of a coordinate, by the index of the coordinate.
        followers: dependence of joints that equalities move, by name.
        start_note: advice where simulations must start, or "".
    """

    name: str
    text: str
    fidelity: Fidelity
    robot: Robot
    files: dict[str, bytes] = field(default_factory=dict)
    leads: Mapping[int, Lead] = field(default_factory=dict)
    followers: Mapping[str, Follower] = field(default_factory=dict)
    start_note: str = ""

    def __repr__(self) -> str:
        size = f"{len(self.text) / 1000.0:.0f} kB"
        return f"Mjcf of '{self.name}': {size}, {format_count(len(self.files), 'further file')}"

    def joint_values(self, q: Values) -> dict[str, float]:
        """Compute the values of all joints, exactly also where equalities are fitted.

        Args:
            q: values of the coordinates.

        Returns:
            Value (rad or m) by the name of the joint.
        """
        values = self.robot.mechanism.values(q)
        leads = {
            joint: line.slope * values[index] + line.offset
            for index, (joint, line) in self.leads.items()
        }
        # The robot has the exact functions; `leads` adds joints that it does not have.
        result = leads | self.robot.joint_values(values)
        for joint, follower in self.followers.items():
            if joint not in result:
                result[joint] = float(polyval(result[follower.leader or ""], follower.polynomial))
        return result

    def write(self, folder: str | Path) -> list[Path]:
        """Write `<name>.xml`, its meshes and `fidelity.json` into a folder.

        Args:
            folder: output folder; created if necessary.

        Returns:
            Paths of the files, the MJCF first. It is written last, when all files that it needs
            exist.

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

    Bodies keep their names and frames. Joints have the names and the values (rad or m) of their
    coordinates.

    Args:
        model: model to translate.
        mujoco: major version of MuJoCo, 3 or 4.
        visuals: whether to write the shapes with which bodies are drawn.
        contact: "native" writes contact forces as contacts of MuJoCo's own law, "none" leaves them
            out.
        fit: "wraps" moves and resizes wrap geoms until tendons match the paths, "force" also fits
            the curves and lengths of muscles to their isometric forces, "none" keeps all numbers of
            the model.
        spline: "quartic" fits one quartic to a function that is not one, "series" a quartic of a
            quartic, which needs a helper joint for each and is about twice as close.
        driver: whether to write the file for `osimlite.mjcf.Driver`, which has no forces: the
            driver computes them from a copy of the model, which is among the files.
        folder: folder of the model file; mesh files are searched there and in its folder
            `Geometry`.
        geometry: further folders for mesh files; those in the environment variable
            OSIMLITE_GEOMETRY, separated as in PATH, follow them.
        name: name of the files without ending; by default that of the model.

    Returns:
        MJCF text with its other files, and the account of what became of every component.

    Raises:
        SettingError: an option has a value that it does not accept.
        ModelError: the model is not a valid mechanism: a frame or body is missing or not connected.
        UnsupportedError: a joint or constraint is not supported.
    """
    if mujoco not in (3, 4):
        raise SettingError(f"mujoco must be 3 or 4, not {mujoco}")
    if contact not in ("native", "none"):
        raise SettingError(f"contact must be 'native' or 'none', not '{contact}'")
    if fit not in ("none", "wraps", "force"):
        raise SettingError(f"fit must be 'none', 'wraps' or 'force', not '{fit}'")
    if spline not in ("quartic", "series"):
        raise SettingError(f"spline must be 'quartic' or 'series', not '{spline}'")
    mechanism = build_mechanism(model)
    fidelity = Fidelity(mechanism.name, f"mjcf {mujoco}")
    model_folder = None if folder is None else Path(folder)
    mesh_files = MeshFiles(MeshFolders(model_folder, geometry))
    shapes = collect_visuals(model, mechanism, fidelity.add, mesh_files) if visuals else Visuals()
    robot = coordinate_names(build_robot(mechanism, visuals=shapes.by_body))
    draft = MjcfDraft(
        model,
        robot,
        fidelity,
        MjcfOptions(mujoco, visuals, contact, fit, spline, driver),
        model_folder,
        mesh_files,
    )
    _add_settings(draft)
    fidelity.translated["/"] = f"mujoco {mechanism.name}"
    for run_pass in (
        *MECHANISM_PASSES,
        *((add_driven,) if driver else FORCE_PASSES),
        *SCENERY_PASSES,
    ):
        run_pass(draft)
    # Components that no pass has accounted for are lost.
    record_dropped_components(draft.tree, fidelity)
    for section in list(draft.root):
        # Empty sections would only clutter the file.
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


def _add_settings(draft: MjcfDraft) -> None:
    """Write the options of the simulation, and the sections of the file in their order."""
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
    # MuJoCo clips the time constant of a constraint to two steps; the closer the impedance is to 1,
    # the stiffer the constraint.
    add_element(
        add_element(root, "default"),
        "equality",
        solref="0.002 1",
        solimp="0.9999 0.9999 0.001 0.5 2",
    )
    # Sections are created in the order that is easiest to read.
    for tag in ("asset", "worldbody", "contact", "equality", "tendon", "actuator", "keyframe"):
        draft.get_section(tag)
