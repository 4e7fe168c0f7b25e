"""Built-in models, each written in Python with the classes of the schema."""

from __future__ import annotations

BUILT_IN = {
    "dynamic-walker": "osimlite.models.dynamic_walker:dynamic_walker",
    "furthest-walker": "osimlite.models.walkers:furthest_walker",
    "steady-walker": "osimlite.models.walkers:steady_walker",
    "human-walker": "osimlite.models.walkers:human_walker",
    "human": "osimlite.models.walking:human",
    "arm": "osimlite.models.arm:arm",
    "jumper": "osimlite.models.jumper:jumper",
    "human-walks": "osimlite.models.predicted_walk:human_walks",
}
"""Function that makes a model, by its name on the command line."""
STUDIES = {"human-walks": "osimlite.models.predicted_walk:write_study"}
"""Function that writes further files of a model, such as a study, by the name of the model."""
