"""Goals of Moco, each in a module of the name of its class (``moco_control_goal.py``), which is how it is found.

A module has one function, ``terms(goal, problem)``: it takes the goal as the schema has it and the
:class:`~osimlite.optimal.problem.Problem`, and gives the :class:`~osimlite.optimal.point.GoalTerms` of
it. Weights, modes, bounds and divisions (by displacement, duration, mass) are the same for all
goals and are none of its business.
"""
