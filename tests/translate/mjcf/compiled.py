"""Translations to MJCF, compiled by MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np

from osimlite.mechanics.multibody.spatial import Array, make_transform
from osimlite.simulation.robot.robot import principal_axes
from osimlite.translate.mjcf.export import Mjcf


class Compiled:
    """Translation that MuJoCo has compiled, with bodies and joints by name.

    Args:
        mjcf: translation.
        own: restore impossible inertias of the model, and set those of added bodies to zero.
    """

    def __init__(self, mjcf: Mjcf, *, own: bool = False) -> None:
        self.mjcf, self.robot = mjcf, mjcf.robot
        self.model = mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
        self.data = mujoco.MjData(self.model)
        for k in range(self.model.nbody if own else 0):
            if self.model.body(k).name.endswith("_speck"):
                self.model.body_mass[k] = self.model.body_inertia[k] = 0.0
        for record in mjcf.fidelity:
            if own and record.kind == "inertia":
                link, _ = self.robot.link_of[record.component]
                self.model.body(link.name).inertia[:] = principal_axes(link.inertia)[0]

    def place(self, q: Array) -> None:
        """Set all joints by the exact functions of the coordinates."""
        for name, value in self.mjcf.joint_values(q).items():
            self.data.joint(name).qpos[0] = value
        mujoco.mj_forward(self.model, self.data)

    def body(self, name: str) -> Array:
        """Return the pose (4, 4) of a body in ground."""
        body = self.data.body(name)
        return make_transform(body.xmat.reshape(3, 3), body.xpos)

    def mass_matrix(self, q: Array) -> Array:
        """Return the mass matrix (n, n) for the rates of the coordinates, at the pose of `place`."""
        # mj_fullM has different arguments in MuJoCo 3 and 4.
        whole = np.zeros((self.model.nv, self.model.nv))
        for row, unit in zip(whole, np.eye(self.model.nv), strict=True):
            mujoco.mj_mulM(self.model, self.data, row, unit)
        dofs = [self.model.joint(joint.name).dofadr[0] for joint in self.robot.moving]
        jacobian = self.robot.joint_jacobian(q)
        return jacobian.T @ whole[np.ix_(dofs, dofs)] @ jacobian
