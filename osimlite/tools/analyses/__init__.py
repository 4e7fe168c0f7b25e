"""OpenSim's analyses of a motion.

Each analysis is a function ``write_...(analysis, motion, tables)``, which
:data:`osimlite.tools.registry.ANALYSES` lists by OpenSim's class names. It gets the analysis of the
setup, the :class:`~osimlite.tools.motion.Motion`, and the writer of its tables,
:class:`~osimlite.tools.motion.AnalysisTables`.
"""
