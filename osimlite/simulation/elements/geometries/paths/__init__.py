"""The classes of paths, each read by the module that has its name: `GeometryPath` by `geometry_path`.

The function `read(builder, owner)` of such a module takes the owner of the path.
"""
