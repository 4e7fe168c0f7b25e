"""Bullet's window, which shows the robot in real time during a motion; the space bar pauses it."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

import numpy as np

from osimlite.errors import SimulationError
from osimlite.simulation.engines.bullet.world import (
    bullet,
    mute_output,
    write_robot,
    write_temporary_file,
)
from osimlite.simulation.robot.robot import Robot

FRAME_S = 1.0 / 60.0
"""Time between two pictures, s."""

YAW_DEG = 25.0
"""First yaw of the camera, degrees: slightly from the side."""

PITCH_DEG = -15.0
"""First pitch of the camera, degrees: slightly from above."""

DISTANCE_FACTOR = 2.0
"""First distance of the camera, as a multiple of the model's size."""

INITIAL_BULLET_VIEW = 50.0, -35.0, 5.0
"""Yaw, pitch (degrees) and distance (m) of Bullet's camera before it is set."""

SPACE = ord(" ")
"""Bullet's code of the space bar."""

ESCAPE = 27
"""Bullet's code of the Escape key."""


class Window:
    """Window with its own robot, which does not take part in the simulation.

    Args:
        robot: the robot with the shapes of its links.
        gravity: gravity (3,), which defines the vertical axis.
        files: mesh files that the robot names.
        values: function of a state of the motion that returns joint values in Bullet's order.

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
                "there is no screen to show the motion on (DISPLAY is not set); leave out --gui (show=True), "
                "and use --animate to write the motion as a GIF"
            )
        with mute_output(1):
            self.client = int(bullet.connect(bullet.GUI))
        if self.client < 0:
            raise SimulationError(
                "Bullet cannot open a window here; leave out --gui (show=True), and use --animate to write the motion as a GIF"
            )
        # Y is up in OpenSim's models without gravity, too.
        y_is_up = abs(gravity[2]) <= max(abs(gravity[0]), abs(gravity[1]))
        switches = {
            bullet.COV_ENABLE_Y_AXIS_UP: y_is_up,
            bullet.COV_ENABLE_GUI: False,
            bullet.COV_ENABLE_KEYBOARD_SHORTCUTS: False,
        }
        for switch, state in switches.items():
            bullet.configureDebugVisualizer(switch, int(state), physicsClientId=self.client)
        with write_temporary_file(write_robot(robot), files) as path:
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
        """Show a state when its time has passed since the first call.

        States between two pictures are skipped. The space bar pauses the motion.

        Args:
            t: time of the state, s.
            y: the state (y,).

        Raises:
            SimulationError: the user has closed the window.
        """
        now, self._last = time.perf_counter(), y
        if self._start is None:
            self._start = t, now
        due = self._start[1] + t - self._start[0]
        # Steps are much shorter than the time between pictures.
        if due < self._next and now < self._next:
            return
        if due > now:
            time.sleep(due - now)
        began = time.perf_counter()
        with self._while_open(t):
            self.draw(self._values(y))
            # On a slow screen, drawing takes at most half of the time.
            self._next = time.perf_counter() + max(FRAME_S, time.perf_counter() - began)
            if SPACE in self.read_pressed_keys():
                pause_start = time.perf_counter()
                while SPACE not in self.read_pressed_keys():
                    time.sleep(FRAME_S)
                self._start = self._start[0], self._start[1] + time.perf_counter() - pause_start

    def hold(self) -> None:
        """Show the last pose until the user closes the window or presses Escape."""
        with suppress(bullet.error):
            if self._last is not None:
                self.draw(self._values(self._last))
            while bullet.isConnected(self.client) and ESCAPE not in self.read_pressed_keys():
                time.sleep(FRAME_S)

    def close(self) -> None:
        """Close the window; may be called repeatedly."""
        if self.client >= 0 and bullet.isConnected(self.client):
            with mute_output(1):
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
        speeds = [(0.0,)] * len(values)
        bullet.resetJointStatesMultiDof(
            self._robot, self._joints, [(x,) for x in values], speeds, client
        )
        if not self._links:
            return
        states = bullet.getLinkStates(self._robot, self._links, physicsClientId=client)
        positions = np.array([state[0] for state in states])
        if self._view is None:
            self._view = (
                YAW_DEG,
                PITCH_DEG,
                max(0.5, DISTANCE_FACTOR * float(np.ptp(positions, axis=0).max())),
            )
        elif selected_view := self._get_selected_view():
            self._view = selected_view
        yaw, pitch, distance = self._view
        bullet.resetDebugVisualizerCamera(
            distance, yaw, pitch, positions.mean(axis=0).tolist(), physicsClientId=client
        )

    def _get_selected_view(self) -> tuple[float, float, float] | None:
        """Return the view that the user has selected.

        Returns:
            Yaw and pitch (degrees) and distance (m); None while they are the initial ones.
        """
        # PyBullet reports the camera of the first world only, and for some pictures an outdated
        # one.
        if self.client != 0:
            return None
        yaw, pitch, distance = bullet.getDebugVisualizerCamera(self.client)[8:11]
        return None if (yaw, pitch, distance) == INITIAL_BULLET_VIEW else (yaw, pitch, distance)

    def read_pressed_keys(self) -> set[int]:
        """Return the keys that were pressed since the last call."""
        keys = bullet.getKeyboardEvents(self.client)
        return {key for key, state in keys.items() if state & bullet.KEY_WAS_TRIGGERED}
