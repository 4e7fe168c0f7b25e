"""Tests of the timing of Bullet's window, with a world that is not displayed: which pose is drawn when."""

from __future__ import annotations

from itertools import pairwise

import pytest

from osimlite.errors import SimulationError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.engines.bullet import window as module
from osimlite.simulation.engines.bullet.world import bullet
from osimlite.simulation.run import Simulation


class Clock:
    """Clock that advances when the code sleeps, and a little with every reading."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        self.now += 1e-6
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(module, "time", clock)
    monkeypatch.setattr(bullet, "GUI", bullet.DIRECT)
    monkeypatch.setenv("DISPLAY", ":0")
    return clock


@pytest.fixture
def keys(monkeypatch):
    """Return a list of the sets of keys that successive readings of the keyboard return; no keys afterwards."""
    pressed: list[set[int]] = []
    monkeypatch.setattr(
        module.Window, "read_pressed_keys", lambda self: pressed.pop(0) if pressed else set()
    )
    return pressed


@pytest.fixture
def drawn(clock, monkeypatch):
    """Return a list of times and poses that the window draws."""
    poses: list[tuple[float, list[float]]] = []
    real = module.Window.draw

    def spy(self, values):
        poses.append((clock.now, list(values)))
        real(self, values)

    monkeypatch.setattr(module.Window, "draw", spy)
    return poses


def _shown(seconds=0.5):
    simulation = Simulation(dynamic_walker(), show=True)
    return simulation, simulation.run(seconds, fixed_step=1e-3)


def test_the_motion_takes_its_time_in_sixty_pictures_a_second(clock, keys, drawn):
    simulation, trajectory = _shown()
    with simulation:
        assert clock.now == pytest.approx(0.5, abs=0.01) and 25 < len(drawn) < 35
        keys += [set(), {module.ESCAPE}]
        simulation.hold()
    assert drawn[-1][1] == pytest.approx(
        [
            trajectory.values[-1][list(trajectory.coordinates).index(name)]
            for name in _moving(simulation)
        ]
    )


def _moving(simulation):
    return [joint.name for joint in simulation.engine.world.joints]


def test_space_stops_and_goes_on(clock, keys, drawn):
    keys += [set(), set(), {module.SPACE}, *[set()] * 120, {module.SPACE}]
    simulation, _ = _shown()
    simulation.close()
    assert clock.now == pytest.approx(0.5 + 121 / 60, abs=0.03)
    # After a pause, the motion continues at its normal speed.
    gaps = [after - before for (before, _), (after, _) in pairwise(drawn)]
    assert sorted(gaps)[-2] < 0.02 and min(gaps) > 0.01


def test_a_slow_screen_leaves_time_for_the_motion(clock, keys, drawn, monkeypatch):
    real = bullet.resetJointStatesMultiDof

    def slowly(*words):
        clock.sleep(0.1)
        return real(*words)

    monkeypatch.setattr(module.bullet, "resetJointStatesMultiDof", slowly)
    _shown()[0].close()
    assert len(drawn) < 10


@pytest.mark.parametrize(
    ("gravity", "y_is_up"), [((0, -9.8, 0), 1), ((0, 0, -9.8), 0), ((0, 0, 0), 1)]
)
def test_what_is_up_and_that_there_are_no_panels(clock, monkeypatch, gravity, y_is_up):
    switches: dict[int, int] = {}
    monkeypatch.setattr(
        bullet,
        "configureDebugVisualizer",
        lambda switch, state, physicsClientId: switches.update({switch: state}),
    )
    model = dynamic_walker()
    model.gravity = gravity
    Simulation(model, show=True).close()
    assert switches[bullet.COV_ENABLE_Y_AXIS_UP] == y_is_up and switches[bullet.COV_ENABLE_GUI] == 0


def test_the_camera_follows_and_stays_as_it_was_turned(clock, keys, monkeypatch):
    views: list[tuple[float, float, float]] = []
    targets: list[list[float]] = []
    turned = [30.0, -40.0, 7.0]

    def aim(distance, yaw, pitch, target, physicsClientId):
        views.append((yaw, pitch, distance))
        targets.append(target)

    monkeypatch.setattr(bullet, "resetDebugVisualizerCamera", aim)
    answers = [module.INITIAL_BULLET_VIEW] * 5
    monkeypatch.setattr(
        bullet,
        "getDebugVisualizerCamera",
        lambda _: (0,) * 8 + (tuple(answers.pop()) if answers else tuple(turned)),
    )
    simulation, _ = _shown()
    is_first = simulation.engine.window.client == 0
    simulation.close()
    assert 0.5 < views[0][2] < 5.0 and views[0] == views[3]
    assert targets[-1] != targets[0] and 0.0 < targets[0][1] < 1.0
    if is_first:
        assert views[-1] == tuple(turned)


def test_a_window_that_is_closed_ends_the_motion(clock, keys, drawn, monkeypatch):
    simulation = Simulation(dynamic_walker(), show=True)
    with simulation:
        real, client = module.Window.draw, simulation.engine.window.client

        def closed(self, values):
            if clock.now > 0.2:
                bullet.disconnect(client)
            real(self, values)

        monkeypatch.setattr(module.Window, "draw", closed)
        with pytest.raises(SimulationError, match=r"the window was closed at t = 0\.2"):
            simulation.run(0.5, fixed_step=1e-3)
        simulation.hold()


def test_without_a_screen(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(SimulationError, match="no screen"):
        Simulation(dynamic_walker(), show=True)
