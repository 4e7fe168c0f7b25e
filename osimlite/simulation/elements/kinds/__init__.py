"""The kinds of forces, each declared in the module that has its class's name: `PathSpring` in `path_spring`.

A module is imported when a model first has a force of its class.
"""
