"""Charcloth in Blender: a mesh is burnt by the `charcloth` program and comes back as a sequence ready to render.

`properties` is what an artist sets, `panel` shows it, `operators` act on it. `mesh_file` and `scene_file` write what
the program reads, `job` runs the program, `loader` brings the frames back, `material` draws them.
"""

from . import operators, panel, preferences, properties

MODULES = (preferences, properties, operators, panel)


def register() -> None:
    """Makes everything known to Blender."""
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Takes everything back, in the other order; jobs that run are stopped."""
    for module in reversed(MODULES):
        module.unregister()
