"""Environments of gymnasium for a task: one copy of the model, or many that are stepped together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from osimlite.base.records import replace
from osimlite.base.text import suggest_name, suggest_or_list
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.copies import Copies
from osimlite.studies.gym.tasks import TASKS, Observation, Task, make_task

OBSERVATION_LIMIT = 1e6
"""Largest magnitude of an observation; infinite and undefined values become it, or 0."""


class _ObservedCopies:
    """Copies of the model of a task, with their observations and initial states.

    Args:
        task: task with its model.
        count: number of copies w.

    Attributes:
        names: paths of the state variables, in the order of the state.
        state_names: short names of the state variables, which observations and tasks use.
        labels: short names of the observed state variables.
        actions: space of actions of one copy.
        observations: space of observations of one copy.
        max_steps: number of steps of an episode.
    """

    def __init__(self, task: Task, count: int) -> None:
        for name in ("seconds", "step"):
            duration = getattr(task, name)
            if not 0.0 < duration < np.inf:
                raise SettingError(f"'{name}' must be a positive number, not {duration:g}")
        if count < 1:
            raise SettingError(f"'num_envs' must be at least 1, not {count}")
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
        self.state_names = [
            *(info.name for info in order),
            *(f"{info.name}/speed" for info in order),
            *("/".join(path.split("/")[-2:]) for path in simulation.state.paths),
        ]
        hidden: Any = task.hidden
        # The letters of a text would be taken for names.
        if isinstance(hidden, str):
            raise SettingError(f"'hidden' must be a tuple of names, such as ('{hidden}',)")
        # A misspelt name would silently leave the coordinate visible.
        for name in task.hidden:
            if name not in self.state_names:
                suggestion = suggest_name(name, self.state_names)
                raise gymnasium.error.Error(
                    f"the environment has no state '{name}' to hide{suggestion}"
                )
        self._visible = [k for k, name in enumerate(self.state_names) if name not in task.hidden]
        self.labels = tuple(self.state_names[k] for k in self._visible)
        paths = self.copies.controls
        tree = simulation.model.tree()
        limits = [(tree.find(path).min_control, tree.find(path).max_control) for path in paths]
        # Learners need bounded actions; controls without bounds are limited to -1 to 1.
        lower, upper = self._limits = np.clip(
            np.array(limits, dtype=np.float32).reshape(-1, 2).T, -1.0, 1.0
        )
        # Learners expect 0 to be a valid action; controls below the smallest excitation count as it.
        self.actions = gymnasium.spaces.Box(np.minimum(lower, 0.0), upper, dtype=np.float32)
        self.observations = gymnasium.spaces.Box(
            -OBSERVATION_LIMIT, OBSERVATION_LIMIT, (len(self._visible),), dtype=np.float32
        )
        self.max_steps = round(task.seconds / task.step)

    def reset_copy(self, copy_index: int, rng: np.random.Generator) -> None:
        """Set a copy to an initial state of the task.

        Args:
            copy_index: index of the copy.
            rng: random generator for the initial state.
        """
        start = self.copies.start
        if self.task.start is not None:
            start = self.task.start(start, self.names, rng)
        self.copies.set_states(copy_index, start)

    def observe(self, controls: Array) -> Observation:
        """Return the states of all copies by name, with the controls of the step (w, c)."""
        states = self.copies.states.copy()
        return Observation(
            dict(zip(self.state_names, states.T, strict=True)), controls, self.task.step
        )

    def flatten_observations(self) -> Any:
        """Return the observations of all copies as finite numbers (w, o)."""
        states = np.nan_to_num(
            self.copies.states[:, self._visible],
            nan=0.0,
            posinf=OBSERVATION_LIMIT,
            neginf=-OBSERVATION_LIMIT,
        )
        return np.clip(states, -OBSERVATION_LIMIT, OBSERVATION_LIMIT).astype(np.float32)

    def step(self, actions: Any, ignored_rows: Any = ()) -> tuple[Array, Any]:
        """Hold controls for a step.

        Args:
            actions: controls (w, c), which are clipped to their bounds.
            ignored_rows: indices of the copies whose actions do not matter.

        Returns:
            Rewards (w,), and whether each copy has failed (w,).

        Raises:
            gymnasium.error.InvalidAction: the actions have another shape, or one that matters is
                NaN.
        """
        values = np.array(actions, dtype=float)
        expected = self.count, len(self.copies.controls)
        if values.shape != expected:
            raise gymnasium.error.InvalidAction(
                f"actions have the shape {expected}, not {values.shape}"
            )
        values[np.asarray(ignored_rows, dtype=int)] = 0.0
        # With NaN the motion would be computed as if it had failed, and the learner would not notice.
        if np.isnan(values).any():
            copy_index, index = np.argwhere(np.isnan(values))[0]
            raise gymnasium.error.InvalidAction(
                f"the action for '{self.copies.controls[index]}' of copy {copy_index} is NaN; give a number"
            )
        controls = np.clip(values, *self._limits)
        observation_before = self.observe(controls)
        has_succeeded = self.copies.step_all(controls)
        observation_after = self.observe(controls)
        # States of a copy whose integration failed may be undefined; its reward is 0.
        with np.errstate(all="ignore"):
            rewards = np.where(
                has_succeeded, self.task.reward(observation_before, observation_after), 0.0
            )
        return rewards, ~has_succeeded | self.task.is_over(observation_after)

    def draw_image(self, copy_index: int = 0) -> Any:
        """Return the image of a copy (height, width, 3)."""
        from osimlite.studies.gym.pictures import draw_pose

        simulation = self.copies.simulation
        return draw_pose(
            simulation, np.array(simulation.state.values(self.copies.states[copy_index].tolist()))
        )


def _resolve_task(
    task: Task | Callable[[], Task] | None, model: Any, reward: Any, options: dict[str, Any]
) -> Task:
    """Return the task that the arguments of an environment describe.

    Raises:
        gymnasium.error.Error: a task has no option of a name, the environment has a fixed model but
            another one is passed, or the model or the reward is missing.
    """
    known_names = [field.name for field in fields(Task) if field.name not in ("model", "reward")]
    for name in options:
        if name not in known_names:
            raise gymnasium.error.Error(
                f"a task has no '{name}'{suggest_or_list(name, known_names)}"
            )
    # A registered environment has a task, whose attributes may be overridden but not its model.
    if task is not None:
        if model is not None:
            raise gymnasium.error.Error(
                "this environment has a fixed model; use osimlite/Model-v0 for another model"
            )
        base_task = task if isinstance(task, Task) else task()
        return replace(base_task, **options, **({} if reward is None else {"reward": reward}))
    if model is None or reward is None:
        raise gymnasium.error.Error("pass a task, or a model and a function reward(before, after)")
    return make_task(model, reward, **options)


def _check_render_mode(mode: str | None) -> str | None:
    """Return the mode of rendering, or None for no rendering.

    Raises:
        gymnasium.error.UnsupportedMode: the mode is neither None nor "rgb_array".
    """
    if mode not in (None, "rgb_array"):
        raise gymnasium.error.UnsupportedMode(f"render_mode must be 'rgb_array', not '{mode}'")
    return mode


class MuscleEnv(gymnasium.Env[Any, Any]):
    """Environment with one copy of a model.

    Observations are values of coordinates (rad or m), generalized speeds, and states of muscles,
    named by `labels`. Actions are the controls of the actuators, named by `controls`.

    Args:
        task: task, or a function that returns it; None with a `model`.
        model: model, or file of a model, in place of a task; None with a `task`.
        reward: function of the observations before and after a step
            (:class:`osimlite.studies.gym.tasks.Observation`) that returns rewards (w,). A `model`
            needs it; it replaces the reward of a `task`.
        render_mode: "rgb_array" or None.
        options: further attributes of :class:`osimlite.studies.gym.tasks.Task`.

    Attributes:
        labels: names of the observations.
        controls: paths of the controls.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 100}  # noqa: RUF012 - as gymnasium has it

    def __init__(
        self,
        task: Task | Callable[[], Task] | None = None,
        *,
        model: Any = None,
        reward: Any = None,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        self._all = _ObservedCopies(_resolve_task(task, model, reward, options), 1)
        self.render_mode = _check_render_mode(render_mode)
        self.observation_space = self._all.observations
        self.action_space = self._all.actions
        self.labels = self._all.labels
        self.controls = self._all.copies.controls
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of the random numbers; None to continue the sequence.
            options: unused; gymnasium requires it.

        Returns:
            Observation (o,), and an empty dictionary.
        """
        super().reset(seed=seed)
        self._all.reset_copy(0, self.np_random)
        self._steps = 0
        return self._all.flatten_observations()[0], {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Hold controls for a control step.

        Args:
            action: controls (c,).

        Returns:
            Observation (o,), reward, whether the model has failed, whether the time of the episode
            is over, and an empty dictionary.
        """
        rewards, has_failed = self._all.step(np.asarray(action)[None])
        self._steps += 1
        return (
            self._all.flatten_observations()[0],
            float(rewards[0]),
            bool(has_failed[0]),
            self._steps >= self._all.max_steps,
            {},
        )

    def render(self) -> Any:
        """Return the pose as an image (height, width, 3); None without a render mode."""
        return self._all.draw_image() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Release the compiled engine."""
        self._all.copies.close()


class MuscleVectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Environment with many copies of a model that are stepped in one call on all cores.

    Each copy behaves like a `MuscleEnv`.

    A copy whose episode is over starts a new one in the next step, which ignores its action.

    Args:
        num_envs: number of copies w.
        task: task, or a function that returns it; None with a `model`.
        model: model, or file of a model, in place of a task; None with a `task`.
        reward: function of the observations before and after a step
            (:class:`osimlite.studies.gym.tasks.Observation`) that returns rewards (w,). A `model`
            needs it; it replaces the reward of a `task`.
        render_mode: "rgb_array" or None.
        options: further attributes of :class:`osimlite.studies.gym.tasks.Task`.

    Attributes:
        labels: names of the observations.
        controls: paths of the controls.
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
        **options: Any,
    ) -> None:
        self.num_envs = num_envs
        self.render_mode = _check_render_mode(render_mode)
        self._all = _ObservedCopies(_resolve_task(task, model, reward, options), num_envs)
        self.single_observation_space = self._all.observations
        self.single_action_space = self._all.actions
        batch = gymnasium.vector.utils.batch_space
        self.observation_space = batch(self.single_observation_space, num_envs)
        self.action_space = batch(self.single_action_space, num_envs)
        self.labels = self._all.labels
        self.controls = self._all.copies.controls
        self._steps = np.zeros(num_envs, dtype=int)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._random: list[np.random.Generator] = []

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode of each copy.

        Args:
            seed: seed of the first copy, the k-th has this plus k; or a list of seeds; None to
                continue the sequences.
            options: unused; gymnasium requires it.

        Returns:
            Observations (w, o), and an empty dictionary.
        """
        # Without a seed, the generators continue, as gymnasium requires.
        if seed is not None or not self._random:
            seeds = (
                seed
                if isinstance(seed, list)
                else [None if seed is None else seed + k for k in range(self.num_envs)]
            )
            self._random = [gymnasium.utils.seeding.np_random(copy_seed)[0] for copy_seed in seeds]
        for k, rng in enumerate(self._random):
            self._all.reset_copy(k, rng)
        self._steps[:], self._ended[:] = 0, False
        return self._all.flatten_observations(), {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Hold controls for a control step.

        Args:
            actions: controls (w, c).

        Returns:
            Observations (w, o), rewards (w,), whether each copy has failed (w,), whether the time
            of its episode is over (w,), and an empty dictionary.
        """
        restarted_rows = np.flatnonzero(self._ended)
        # All copies are stepped, then those with a new episode are set to their initial state.
        initial = {int(k): self._reset_state(int(k)) for k in restarted_rows}
        rewards, has_failed = self._all.step(actions, restarted_rows)
        for k, state in initial.items():
            self._all.copies.set_states(k, state)
        self._steps += 1
        # gymnasium's NEXT_STEP mode: the step after an end returns the first observation and no
        # reward.
        self._steps[restarted_rows], rewards[restarted_rows], has_failed[restarted_rows] = (
            0,
            0.0,
            False,
        )
        # Truncation by time differs from termination: the learner may still expect future rewards.
        is_out_of_time = self._steps >= self._all.max_steps
        self._ended = has_failed | is_out_of_time
        return self._all.flatten_observations(), rewards, has_failed, is_out_of_time, {}

    def _reset_state(self, copy_index: int) -> Array:
        """Return a new initial state of a copy, drawn by the random generator of this copy."""
        self._all.reset_copy(copy_index, self._random[copy_index])
        return self._all.copies.states[copy_index].copy()

    def render(self) -> Any:
        """Return the poses of all copies as images (height, width, 3); None without a render mode."""
        return (
            tuple(self._all.draw_image(k) for k in range(self.num_envs))
            if self.render_mode == "rgb_array"
            else None
        )

    def close_extras(self, **kwargs: Any) -> None:
        """Release the compiled engines."""
        self._all.copies.close()


def _make_single(name: str) -> Callable[..., MuscleEnv]:
    """Return the function with which Gymnasium makes one environment of a task."""
    return lambda **options: MuscleEnv(TASKS[name], **options)


def _make_vector(name: str) -> Callable[..., MuscleVectorEnv]:
    """Return the function with which Gymnasium makes several environments of a task."""
    return lambda num_envs=1, **options: MuscleVectorEnv(num_envs, TASKS[name], **options)


def register_all() -> None:
    """Register the environments with gymnasium."""
    for name in TASKS:
        if f"osimlite/{name}" not in gymnasium.registry:
            gymnasium.register(
                f"osimlite/{name}", _make_single(name), vector_entry_point=_make_vector(name)
            )
    if "osimlite/Model-v0" not in gymnasium.registry:
        gymnasium.register("osimlite/Model-v0", MuscleEnv, vector_entry_point=MuscleVectorEnv)
