"""The panels: Properties > Physics of a mesh, Properties > Data of an empty."""

import textwrap

import bpy

from . import operators
from .preferences import find_program
from .properties import sheet_of
from .scene_file import physical

WIDTH = 60  # letters in a line of a message


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Meshes burn."""
        return sheet_of(context) is not None


class _SubPanel(_Panel):
    bl_parent_id = "CHARCLOTH_PT_sheet"

    def draw(self, context: bpy.types.Context) -> None:
        """The settings, below each other, while nothing runs."""
        self.layout.use_property_split = True
        sheet = sheet_of(context)
        self.layout.enabled = sheet.name not in operators.jobs
        self.fill(self.layout, sheet)


class SheetPanel(_Panel, bpy.types.Panel):
    """Burn, how far it is, and what went wrong."""

    bl_idname = "CHARCLOTH_PT_sheet"
    bl_label = "Charcloth"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Buttons above, words of the program below."""
        sheet, layout = sheet_of(context), self.layout
        settings = sheet.charcloth
        column = layout.column()
        column.use_property_split = True
        column.enabled = sheet.name not in operators.jobs
        column.prop(settings, "preset")
        if physical(settings):
            column.prop(settings, "speed")
        if find_program() is None:
            layout.label(text="The charcloth program was not found: see the preferences of the add-on", icon="ERROR")
        if sheet.name in operators.jobs:
            row = layout.row()
            row.progress(factor=settings.progress, text=settings.state)
            row.operator("charcloth.cancel", icon="CANCEL")
        else:
            row = layout.row(align=True)
            row.operator("charcloth.burn", icon="PLAY")
            if operators.can_resume(sheet):
                row.operator("charcloth.resume", icon="FF")
            row = layout.row(align=True)
            row.operator("charcloth.load", icon="IMPORT")
            if settings.burnt is not None:
                row.operator("charcloth.unload", icon="X")
        for line in lines(settings.message):
            layout.label(text=line)


class FirePanel(_SubPanel, bpy.types.Panel):
    """Where it is lit and held."""

    bl_idname = "CHARCLOTH_PT_sparks"
    bl_label = "Sparks and Pins"

    def fill(self, layout: bpy.types.UILayout, sheet: bpy.types.Object) -> None:
        """Sparks, then groups."""
        settings = sheet.charcloth
        layout.prop(settings, "sparks")
        layout.operator("charcloth.add_spark", icon="ADD")
        for key in ("ignite", "pin", "noburn") if physical(settings) else ("ignite", "pin"):
            layout.prop_search(settings, key, sheet, "vertex_groups", results_are_suggestions=True)
        layout.label(text="The name of a painted attribute does as well")


class MotionPanel(_SubPanel, bpy.types.Panel):
    """How it moves, and how long."""

    bl_idname = "CHARCLOTH_PT_motion"
    bl_label = "Motion and Time"

    def fill(self, layout: bpy.types.UILayout, sheet: bpy.types.Object) -> None:
        """Integrator, forces, frames."""
        for key in ("integrator", "wind", "gust", "gravity"):
            layout.prop(sheet.charcloth, key)
        column = layout.column(align=True)
        column.prop(sheet.charcloth, "frame_start")
        column.prop(sheet.charcloth, "frame_end")


class ContactPanel(_SubPanel, bpy.types.Panel):
    """What it falls on."""

    bl_idname = "CHARCLOTH_PT_contact"
    bl_label = "Contact"
    bl_options = {"DEFAULT_CLOSED"}

    def fill(self, layout: bpy.types.UILayout, sheet: bpy.types.Object) -> None:
        """Table, obstacles, itself."""
        settings = sheet.charcloth
        row = layout.row(heading="Table")
        row.prop(settings, "table", text="")
        height = row.row()
        height.enabled = settings.table
        height.prop(settings, "table_height", text="")
        layout.prop(settings, "obstacles")
        layout.prop(settings, "self_contact")


class OutputPanel(_SubPanel, bpy.types.Panel):
    """How fine it is, and where files go."""

    bl_idname = "CHARCLOTH_PT_output"
    bl_label = "Mesh and Output"

    def fill(self, layout: bpy.types.UILayout, sheet: bpy.types.Object) -> None:
        """Spacing, flames, folder, further keys."""
        settings = sheet.charcloth
        layout.prop(settings, "refine")
        column = layout.column()
        column.enabled = settings.refine
        column.prop(settings, "spacing")
        layout.prop(settings, "burn_level")
        if physical(settings):
            row = layout.row(heading="Flames")
            row.prop(settings, "flames", text="")
            voxel = row.row()
            voxel.enabled = settings.flames
            voxel.prop(settings, "voxel", text="")
        layout.prop(settings, "folder")
        layout.prop(settings, "overrides")


class SparkPanel(bpy.types.Panel):
    """When and how an empty lights."""

    bl_idname = "CHARCLOTH_PT_spark"
    bl_label = "Charcloth Spark"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Empties light."""
        return context.object is not None and context.object.type == "EMPTY"

    def draw(self, context: bpy.types.Context) -> None:
        """Its settings."""
        self.layout.use_property_split = True
        for key in ("frame", "length", "temperature"):
            self.layout.prop(context.object.charcloth_spark, key)


def lines(message: str) -> list[str]:
    """A message in lines that a panel has room for."""
    return [part for line in message.splitlines() for part in textwrap.wrap(line, WIDTH) or [""]]


CLASSES = (SheetPanel, FirePanel, MotionPanel, ContactPanel, OutputPanel, SparkPanel)


def register() -> None:
    """Makes the panels known."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Takes them back."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
