"""Models written in the library's own words, ready to build."""

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
"""Name on the command line, and where the function is that makes the model."""
STUDIES = {"human-walks": "osimlite.models.predicted_walk:write_study"}
"""Where the function is that writes what belongs to a model beside its file."""
