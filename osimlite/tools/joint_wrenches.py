"""What each joint carries along a motion."""

from __future__ import annotations

import numpy as np

from osimlite.mechanics.kernels.layout import LINK_WORK
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.joints import Joint
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.link_motion import LinkMotion
from osimlite.simulation.system import System
from osimlite.tools.constraint_forces import ConstraintForces
from osimlite.tools.motion import Motion


class JointWrenches:
    """What the joints carry along a motion, by the Newton-Euler equations of the bodies beyond them."""

    @classmethod
    def along(cls, motion: Motion, controls: Controls | None = None) -> JointWrenches:
        """Those of a motion, which are found once if nothing else drives the actuators."""
        if controls is not None:
            return cls(motion, controls)
        return motion.once("joint wrenches", lambda: cls(motion, None))

    def __init__(self, motion: Motion, controls: Controls | None) -> None:
        self.mechanism = motion.mechanism
        self.carried = {
            body.mobilizer.joint: index for index, body in enumerate(self.mechanism.bodies)
        }
        system = System(self.mechanism, motion.simulation.forces, apart=True)
        if controls is not None:
            system.drive(controls)
        balanced = motion.select(motion.balanced) if motion.unbalanced else motion
        self.moved = LinkMotion.of(
            system, balanced.table, balanced.accelerations[:, list(system.order)]
        )
        if self.mechanism.constrained:
            for links, forces in zip(
                self.moved.links, ConstraintForces.along(balanced), strict=True
            ):
                self._push(links, forces)
        if motion.unbalanced:
            self.moved = LinkMotion(system, self._spread(motion))

    def _spread(self, motion: Motion) -> Array:
        """Return the links at all times (t, l, n): without wrenches where a muscle lacks an equilibrium."""
        still = System(self.mechanism.released(), Forces(()), apart=True)
        moments = np.column_stack([motion.times, still.state.rows(motion.values, motion.speeds)])
        links = still.links_in_motion(moments, motion.accelerations[:, list(still.order)])
        links[motion.balanced] = self.moved.links
        return links

    def _push(self, links: Array, forces: ConstraintForces) -> None:
        """Let constraints push bodies (l, n), and all that carry them."""
        for constraint, multipliers in forces.multipliers:
            for body, wrench in zip(
                constraint.bodies, forces.on_bodies(constraint, multipliers), strict=True
            ):
                force, here = wrench[3:], forces.state.origins[body]
                while body != GROUND:
                    arm = here - links[body, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
                    about = np.concatenate([wrench[:3] + np.cross(arm, force), force])
                    links[body, LINK_WORK.WRENCH : LINK_WORK.WRENCH + 6] += about
                    body = self.mechanism.bodies[body].parent

    def of(self, joint: Joint, side: str) -> tuple[Array, Array, Array]:
        """Force, moment, and the origin of the joint's frame at which they act (t, 3), in ground."""
        outer = self.carried[joint.path]
        body, link = self.mechanism.bodies[outer], self.moved.links[:, outer]
        mobilizer = body.mobilizer
        # The body that the joint carries in the tree gets what is missing there, the other one the
        # opposite.
        is_outer = (side == "child") != mobilizer.reversed
        wrench = (-1.0 if is_outer else 1.0) * link[:, LINK_WORK.WRENCH : LINK_WORK.WRENCH + 6]
        frame = mobilizer.child_frame if side == "child" else mobilizer.parent_frame
        _, place = self.moved.placed(outer if is_outer else body.parent, frame)
        arm = place - link[:, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
        return wrench[:, 3:], wrench[:, :3] - np.cross(arm, wrench[:, 3:]), place
