"""Bullet's window: a picture of the robot that follows the motion in real time. The space bar stops it meanwhile."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

import numpy as np

from osimlite.errors import SimulationError
from osimlite.simulation.engines.bullet.world import bullet, muted, robot_text, temporary_file
from osimlite.simulation.robot.robot import Robot

FRAME = 1.0 / 60.0
"""Time between two pictures, s."""

YAW, PITCH, SIZES_AWAY = 25.0, -15.0, 2.0
"""From where the camera looks at first, degrees: a little from the side and from above; and how far away it is."""

BULLETS_VIEW = 50.0, -35.0, 5.0
"""Yaw, pitch (degrees) and distance (m) of the camera before it is told anything."""

SPACE, ESCAPE = ord(" "), 27


class Window:
    """A window with a robot of its own, which is only looked at.

    Args:
        robot: with what its links look like.
        gravity: (3,) tells what is up.
        files: mesh files that the robot names.
        values: of the joints in Bullet's order at a state of the motion.

    Raises:
        SimulationError: there is no screen.
    """

    def __init__(
        self,
        robot: Robot,
        gravity: Sequence[float],
        files: Mapping[str, bytes],
        values: Callable[[Sequence[float]], Sequence[float]],
    ) -> None:
        if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
            raise SimulationError(
                "there is no screen to show the motion on (DISPLAY is not set); leave out --gui, "
                "and take --animate for a film"
            )
        with muted(1):
            self.client = int(bullet.connect(bullet.GUI))
        if self.client < 0:
            raise SimulationError(
                "Bullet opens no window here; leave out --gui, and take --animate for a film"
            )
        # Models without gravity have OpenSim's Y up too.
        y_is_up = abs(gravity[2]) <= max(abs(gravity[0]), abs(gravity[1]))
        switches = {
            bullet.COV_ENABLE_Y_AXIS_UP: y_is_up,
            bullet.COV_ENABLE_GUI: False,
            bullet.COV_ENABLE_KEYBOARD_SHORTCUTS: False,
        }
        for switch, state in switches.items():
            bullet.configureDebugVisualizer(switch, int(state), physicsClientId=self.client)
        with temporary_file(robot_text(robot), files) as path:
            self._robot = bullet.loadURDF(path, useFixedBase=1, physicsClientId=self.client)
        count = bullet.getNumJoints(self._robot, self.client)
        infos = [bullet.getJointInfo(self._robot, index, self.client) for index in range(count)]
        self._links = list(range(count))
        self._joints = [int(info[0]) for info in infos if info[3] >= 0]
        self._view: tuple[float, float, float] | None = None
        self._next = time.perf_counter()
        self._start: tuple[float, float] | None = None
        self._values = values
        self._last: Sequence[float] | None = None

    def show(self, t: float, y: Sequence[float]) -> None:
        """Show a state when the time t (s) since the first call has passed.

        Raises:
            SimulationError: somebody has closed the window.
        """
        now, self._last = time.perf_counter(), y
        if self._start is None:
            self._start = t, now
        due = self._start[1] + t - self._start[0]
        if due < self._next and now < self._next:
            return
        if due > now:
            time.sleep(due - now)
        began = time.perf_counter()
        with self._while_open(t):
            self.draw(self._values(y))
            # A slow screen leaves half of the time to the motion.
            self._next = time.perf_counter() + max(FRAME, time.perf_counter() - began)
            if SPACE in self.pressed_keys():
                stopped = time.perf_counter()
                while SPACE not in self.pressed_keys():
                    time.sleep(FRAME)
                self._start = self._start[0], self._start[1] + time.perf_counter() - stopped

    def hold(self) -> None:
        """Keep the last pose in sight until somebody closes the window or presses Escape."""
        with suppress(bullet.error):
            if self._last is not None:
                self.draw(self._values(self._last))
            while bullet.isConnected(self.client) and ESCAPE not in self.pressed_keys():
                time.sleep(FRAME)

    def close(self) -> None:
        """Close the window; any number of times."""
        if self.client >= 0 and bullet.isConnected(self.client):
            with muted(1):
                bullet.disconnect(self.client)
        self.client = -1

    @contextmanager
    def _while_open(self, t: float) -> Iterator[None]:
        try:
            yield
        except bullet.error:
            if bullet.isConnected(self.client):
                raise
            raise SimulationError(
                f"the window was closed at t = {t:.3g} s, before the motion had ended"
            ) from None

    def draw(self, values: Sequence[float]) -> None:
        """Show the robot with these joint values."""
        client = self.client
        rest = [(0.0,)] * len(values)
        bullet.resetJointStatesMultiDof(
            self._robot, self._joints, [(x,) for x in values], rest, client
        )
        if not self._links:
            return
        states = bullet.getLinkStates(self._robot, self._links, physicsClientId=client)
        places = np.array([state[0] for state in states])
        if self._view is None:
            self._view = YAW, PITCH, max(0.5, SIZES_AWAY * float(np.ptp(places, axis=0).max()))
        elif asked := self._asked():
            self._view = asked
        yaw, pitch, distance = self._view
        bullet.resetDebugVisualizerCamera(
            distance, yaw, pitch, places.mean(axis=0).tolist(), physicsClientId=client
        )

    def _asked(self) -> tuple[float, float, float] | None:
        """The view that somebody has turned to; None as long as it is that of the start."""
        # PyBullet tells of the first world only, and for some pictures yet what was before.
        if self.client != 0:
            return None
        yaw, pitch, distance = bullet.getDebugVisualizerCamera(self.client)[8:11]
        return None if (yaw, pitch, distance) == BULLETS_VIEW else (yaw, pitch, distance)

    def pressed_keys(self) -> set[int]:
        """Return the keys that were pressed since the last call."""
        keys = bullet.getKeyboardEvents(self.client)
        return {key for key, state in keys.items() if state & bullet.KEY_WAS_TRIGGERED}
