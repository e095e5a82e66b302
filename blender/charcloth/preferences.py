"""Where the `charcloth` program is."""

import os
import shutil

import bpy


class Preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = __package__

    program: bpy.props.StringProperty(
        name="Program",
        description="The charcloth program; empty: the one on the PATH",
        subtype="FILE_PATH",
    )
    threads: bpy.props.IntProperty(
        name="Threads", description="Threads it may use; 0: one a processor", default=0, min=0, max=1024
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """The preferences, and which program they lead to."""
        self.layout.prop(self, "program")
        self.layout.prop(self, "threads")
        found = find_program()
        self.layout.label(text=found or "not found", icon="CHECKMARK" if found else "ERROR")


def _own() -> Preferences | None:
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def find_program() -> str | None:
    """Path of the program: that of the preferences, else of the variable CHARCLOTH, else the one on the PATH."""
    own = _own()
    named = bpy.path.abspath(own.program) if own and own.program else os.environ.get("CHARCLOTH", "")
    return shutil.which(named or "charcloth")


def thread_arguments() -> list[str]:
    """What tells the program how many threads to use."""
    own = _own()
    return ["--threads", str(own.threads)] if own and own.threads else []


def register() -> None:
    """Makes the preferences known."""
    bpy.utils.register_class(Preferences)


def unregister() -> None:
    """Takes them back."""
    bpy.utils.unregister_class(Preferences)
