"""Gymnasium's environments of a task: one copy, or many that are stepped together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from osimlite.base.records import replace
from osimlite.base.text import suggest_name, suggest_or_list
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.copies import Copies
from osimlite.studies.gym.tasks import TASKS, Seen, Task, of_model

FAR = 1e6
"""No observation is larger; what is not finite ends an episode."""


class _Observed:
    """Copies of the model of a task, what is seen of them, and how they begin."""

    def __init__(self, task: Task, count: int) -> None:
        self.task, self.count = task, count
        self.copies = Copies(task.model(), count, task.step, task)
        simulation = self.copies.simulation
        infos = simulation.mechanism.coordinates
        order = [infos[k] for k in simulation.state.order]
        self.names = (
            *(f"{info.path}/value" for info in order),
            *(f"{info.path}/speed" for info in order),
            *simulation.state.paths,
        )
        self.shown = [
            *(info.name for info in order),
            *(f"{info.name}/speed" for info in order),
            *("/".join(path.split("/")[-2:]) for path in simulation.state.paths),
        ]
        for name in task.hidden:
            if name not in self.shown:
                near = suggest_name(name, self.shown)
                raise gymnasium.error.Error(
                    f"nothing is called '{name}' that could be hidden{near}"
                )
        self._visible = [k for k, name in enumerate(self.shown) if name not in task.hidden]
        self.labels = tuple(self.shown[k] for k in self._visible)
        paths = self.copies.controls
        tree = simulation.model.tree()
        limits = [(tree.at(path).min_control, tree.at(path).max_control) for path in paths]
        low, high = self._limits = np.clip(
            np.array(limits, dtype=np.float32).reshape(-1, 2).T, -1.0, 1.0
        )
        # What is below the least excitation is the least.
        self.actions = gymnasium.spaces.Box(np.minimum(low, 0.0), high, dtype=np.float32)
        self.observations = gymnasium.spaces.Box(-FAR, FAR, (len(self._visible),), dtype=np.float32)
        self.most = round(task.seconds / task.step)

    def begin(self, which: int, rng: np.random.Generator) -> None:
        """Have a copy begin anew."""
        start = self.copies.start
        if self.task.start is not None:
            start = self.task.start(start, self.names, rng)
        self.copies.set_states(which, start)

    def seen(self, controls: Array) -> Seen:
        states = self.copies.states.copy()
        return Seen(dict(zip(self.shown, states.T, strict=True)), controls, self.task.step)

    def observed(self) -> Any:
        """(w, o)."""
        states = np.nan_to_num(
            self.copies.states[:, self._visible], nan=0.0, posinf=FAR, neginf=-FAR
        )
        return np.clip(states, -FAR, FAR).astype(np.float32)

    def step(self, actions: Any) -> tuple[Array, Any]:
        """Rewards (w,) and which copies have failed (w,)."""
        given = np.asarray(actions, dtype=float)
        if given.shape != (wanted := (self.count, len(self.copies.controls))):
            raise gymnasium.error.InvalidAction(
                f"actions have the shape {wanted}, not {given.shape}"
            )
        controls = np.clip(given, *self._limits)
        before = self.seen(controls)
        going = self.copies.step_all(controls)
        after = self.seen(controls)
        with np.errstate(all="ignore"):
            rewards = np.where(going, self.task.reward(before, after), 0.0)
        return rewards, ~going | self.task.is_over(after)

    def picture(self, which: int = 0) -> Any:
        """A copy as an image (h, w, 3)."""
        from osimlite.studies.gym.pictures import picture_of

        simulation = self.copies.simulation
        return picture_of(
            simulation, np.array(simulation.state.values(self.copies.states[which].tolist()))
        )


def _resolve_task(
    task: Task | Callable[[], Task] | None, model: Any, reward: Any, choices: dict[str, Any]
) -> Task:
    known = [field.name for field in fields(Task) if field.name not in ("model", "reward")]
    for name in choices:
        if name not in known:
            raise gymnasium.error.Error(f"a task has no '{name}'{suggest_or_list(name, known)}")
    if task is not None:
        if model is not None:
            raise gymnasium.error.Error(
                "this environment has its model; take osimlite/Model-v0 for another"
            )
        made = task if isinstance(task, Task) else task()
        return replace(made, **choices, **({} if reward is None else {"reward": reward}))
    if model is None or reward is None:
        raise gymnasium.error.Error("give a task, or a model and a reward(before, after)")
    return of_model(model, reward, **choices)


def _check_render_mode(mode: str | None) -> str | None:
    if mode not in (None, "rgb_array"):
        raise gymnasium.error.UnsupportedMode(f"pictures come as 'rgb_array', not as '{mode}'")
    return mode


class MuscleEnv(gymnasium.Env[Any, Any]):
    """One copy of a model that is to learn something.

    Args:
        task: what, or the function that makes it.
        model: instead, a model or its file, with `reward`, a function of what was seen before and
            after a step (:class:`osimlite.studies.gym.tasks.Seen`), and attributes of
            :class:`osimlite.studies.gym.tasks.Task` as `choices`.
        reward: as said.
        render_mode: "rgb_array" or None.
        choices: as said.

    Observations are the values of coordinates (rad, m), generalized speeds, and states of muscles,
    named by `labels`; actions are the controls of the actuators, named by `controls`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 100}  # noqa: RUF012 - as gymnasium has it

    def __init__(
        self,
        task: Task | Callable[[], Task] | None = None,
        *,
        model: Any = None,
        reward: Any = None,
        render_mode: str | None = None,
        **choices: Any,
    ) -> None:
        self._all = _Observed(_resolve_task(task, model, reward, choices), 1)
        self.render_mode = _check_render_mode(render_mode)
        self.observation_space, self.action_space = self._all.observations, self._all.actions
        self.labels, self.controls = self._all.labels, self._all.copies.controls
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        self._all.begin(0, self.np_random)
        self._steps = 0
        return self._all.observed()[0], {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Hold controls (c,) for a step."""
        rewards, over = self._all.step(np.asarray(action)[None])
        self._steps += 1
        return (
            self._all.observed()[0],
            float(rewards[0]),
            bool(over[0]),
            self._steps >= self._all.most,
            {},
        )

    def render(self) -> Any:
        """The pose as an image (h, w, 3); None without a mode."""
        return self._all.picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free what the copy holds."""
        self._all.copies.close()


class MuscleVectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many copies of a model, stepped in one call of machine code on all cores; each as a `MuscleEnv` would be.

    Copies whose episode is over begin anew with the next step, whose action is not used.
    """

    metadata = {  # noqa: RUF012 - as gymnasium has it
        "render_modes": ["rgb_array"],
        "render_fps": 100,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        task: Task | Callable[[], Task] | None = None,
        *,
        model: Any = None,
        reward: Any = None,
        render_mode: str | None = None,
        **choices: Any,
    ) -> None:
        self.num_envs, self.render_mode = num_envs, _check_render_mode(render_mode)
        self._all = _Observed(_resolve_task(task, model, reward, choices), num_envs)
        self.single_observation_space, self.single_action_space = (
            self._all.observations,
            self._all.actions,
        )
        batch = gymnasium.vector.utils.batch_space
        self.observation_space = batch(self.single_observation_space, num_envs)
        self.action_space = batch(self.single_action_space, num_envs)
        self.labels, self.controls = self._all.labels, self._all.copies.controls
        self._steps = np.zeros(num_envs, dtype=int)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._random: list[np.random.Generator] = []

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode of each copy; of a seed the k-th has that plus k."""
        if seed is not None or not self._random:
            seeds = (
                seed
                if isinstance(seed, list)
                else [None if seed is None else seed + k for k in range(self.num_envs)]
            )
            self._random = [gymnasium.utils.seeding.np_random(each)[0] for each in seeds]
        for k, rng in enumerate(self._random):
            self._all.begin(k, rng)
        self._steps[:], self._ended[:] = 0, False
        return self._all.observed(), {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Hold controls (w, c) for a step."""
        again = np.flatnonzero(self._ended)
        kept = {int(k): self._initial_state(int(k)) for k in again}
        rewards, over = self._all.step(actions)
        for k, state in kept.items():
            self._all.copies.set_states(k, state)
        self._steps += 1
        self._steps[again], rewards[again], over[again] = 0, 0.0, False
        late = self._steps >= self._all.most
        self._ended = over | late
        return self._all.observed(), rewards, over, late, {}

    def _initial_state(self, k: int) -> Array:
        """The state in which a copy begins anew."""
        self._all.begin(k, self._random[k])
        return self._all.copies.states[k].copy()

    def render(self) -> Any:
        """The poses of all copies as images; None without a mode."""
        return (
            tuple(self._all.picture(k) for k in range(self.num_envs))
            if self.render_mode == "rgb_array"
            else None
        )

    def close_extras(self, **kwargs: Any) -> None:
        """Free what the copies hold."""
        self._all.copies.close()


def _make_single(name: str) -> Callable[..., MuscleEnv]:
    return lambda **choices: MuscleEnv(TASKS[name], **choices)


def _make_vector(name: str) -> Callable[..., MuscleVectorEnv]:
    return lambda num_envs=1, **choices: MuscleVectorEnv(num_envs, TASKS[name], **choices)


def register_all() -> None:
    """Have gymnasium know the environments."""
    for name in TASKS:
        if f"osimlite/{name}" not in gymnasium.registry:
            gymnasium.register(
                f"osimlite/{name}", _make_single(name), vector_entry_point=_make_vector(name)
            )
    if "osimlite/Model-v0" not in gymnasium.registry:
        gymnasium.register("osimlite/Model-v0", MuscleEnv, vector_entry_point=MuscleVectorEnv)
