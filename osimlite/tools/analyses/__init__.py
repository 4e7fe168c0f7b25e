"""What OpenSim's analyses compute along a motion.

An analysis is one module with the name of its class in lower case, which is how it is found. It has
a function ``compute(analysis, motion, tables)``: what the setup says of it, the
:class:`~osimlite.tools.motion.Motion`, and where its :class:`~osimlite.tools.motion.Tables` go.
"""
