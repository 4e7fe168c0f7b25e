"""Path constraints of Moco, each in a module of the name of its class, which is how it is found.

A module has one function, ``rows(constraint, problem)``: it takes the constraint as the schema has
it and the :class:`~osimlite.optimal.problem.Problem`, and gives the
:class:`~osimlite.optimal.point.ConstraintRows` of it.
"""
