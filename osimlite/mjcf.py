"""A model in MuJoCo with OpenSim's own laws, under the name that users import.

See :mod:`osimlite.translate.mjcf.driver`.
"""

from osimlite.translate.mjcf.driver import Driver

__all__ = ["Driver"]
