"""Programs that read URDF files independently of the writer: PyBullet, yourdfpy and MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from osimlite.mechanics.multibody.spatial import Array, make_transform
from osimlite.simulation.robot.robot import Robot, RobotLink, principal_axes


class Bullet:
    """Robot in PyBullet without damping and motors, with its joints and links by name."""

    def __init__(self, path: Path, client: int) -> None:
        import pybullet

        self.pb, self.client = pybullet, client
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        self.body = pybullet.loadURDF(
            str(path), useFixedBase=True, flags=flags, physicsClientId=client
        )
        infos = [
            pybullet.getJointInfo(self.body, k, client)
            for k in range(pybullet.getNumJoints(self.body, client))
        ]
        self.joints = {info[1].decode(): info for info in infos}
        self.links = {info[12].decode(): info[0] for info in infos}
        for k in range(len(infos)):
            pybullet.changeDynamics(
                self.body,
                k,
                linearDamping=0,
                angularDamping=0,
                jointDamping=0,
                physicsClientId=client,
            )
            if infos[k][2] != pybullet.JOINT_FIXED:
                pybullet.setJointMotorControl2(
                    self.body, k, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client
                )

    def set(self, values: dict[str, float], rates: dict[str, float] | None = None) -> None:
        for name, value in values.items():
            rate = (rates or {}).get(name, 0.0)
            self.pb.resetJointState(
                self.body, self.joints[name][0], value, rate, physicsClientId=self.client
            )

    def inertial_frame(self, link: str) -> Array:
        """Return mass centre and principal axes of a link in the root (4, 4).

        Bullet keeps these in double precision; the link frames that it reports passed through
        single precision.
        """
        state = self.pb.getLinkState(
            self.body, self.links[link], computeForwardKinematics=1, physicsClientId=self.client
        )
        return make_transform(
            np.reshape(self.pb.getMatrixFromQuaternion(state[1]), (3, 3)), state[0]
        )

    def mass_matrix(self, names: list[str]) -> Array:
        """Return the mass matrix for the joints in the order of `names`."""
        moving = sorted(info[3] for info in self.joints.values() if info[3] >= 0)
        by_place = {info[3]: name for name, info in self.joints.items()}
        inside = [by_place[place] for place in moving]
        values = [
            self.pb.getJointState(self.body, self.joints[name][0], physicsClientId=self.client)[0]
            for name in inside
        ]
        matrix = np.array(
            self.pb.calculateMassMatrix(self.body, values, physicsClientId=self.client)
        )
        order = [inside.index(name) for name in names]
        return matrix[np.ix_(order, order)]


@contextmanager
def in_bullet(text: str, files: dict[str, bytes] | None = None) -> Iterator[Bullet]:
    """Load URDF text into a separate PyBullet world."""
    pybullet = pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        # By default Bullet reuses the text of an earlier file with the same name.
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=client)
        with written(text, files) as path:
            yield Bullet(path, client)
    finally:
        pybullet.disconnect(client)


@contextmanager
def written(text: str, files: dict[str, bytes] | None = None) -> Iterator[Path]:
    with TemporaryDirectory() as folder:
        for name, content in (files or {}).items():
            (Path(folder) / name).parent.mkdir(exist_ok=True)
            (Path(folder) / name).write_bytes(content)
        path = Path(folder) / "robot.urdf"
        path.write_text(text)
        yield path


def inertial_frame(link: RobotLink) -> Array:
    """Return Bullet's inertial frame of a link in the link frame."""
    return make_transform(principal_axes(link.inertia)[1], link.center)


def yourdfpy_poses(text: str, values: dict[str, float]) -> dict[str, Array]:
    """Return the pose of every link in the root (4, 4), by yourdfpy."""
    yourdfpy = pytest.importorskip("yourdfpy")
    with written(text) as path:
        reader = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    reader.update_cfg({name: values[name] for name in reader.actuated_joint_names})
    return {name: reader.get_transform(name, "world") for name in reader.link_map}


def mujoco_poses(text: str, values: dict[str, float]) -> tuple[dict[str, Array], float]:
    """Read a URDF with MuJoCo.

    Args:
        text: the URDF.
        values: positions of the joints.

    Returns:
        Pose of every moving link in the root (4, 4), and the sum of the masses.
    """
    mujoco = pytest.importorskip("mujoco")
    # By default MuJoCo merges links that do not move relative to each other.
    model = mujoco.MjModel.from_xml_string(
        text.replace("<compiler ", '<compiler fusestatic="false" ')
    )
    data = mujoco.MjData(model)
    for name, value in values.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    bodies = [data.body(number) for number in range(1, model.nbody)]
    poses = {body.name: make_transform(body.xmat.reshape(3, 3), body.xpos) for body in bodies}
    return {"world": np.eye(4), **poses}, float(model.body_mass.sum())


def worst_body(robot: Robot, poses: dict[str, Array], q: Array) -> float:
    """Return the largest difference between poses of bodies in the mechanism and poses from the robot's links.

    Args:
        robot: the robot.
        poses: pose of each link.
        q: coordinates of the mechanism.
    """
    wanted = robot.mechanism.body_transforms(q)
    differences = [
        float(np.abs(poses[link.name] @ frame - wanted[body.name]).max())
        for body in robot.mechanism.bodies
        for link, frame in [robot.link_of[body.path]]
    ]
    return max(differences, default=0.0)
