"""What an artist sets: on a sheet, and on an empty that lights it."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .presets import PRESETS

INTEGRATORS = (
    ("symplectic_euler", "Springs", "Soft sheet, explicit: quick to set up, stretches a little"),
    ("implicit", "Shell", "Sheet with the moduli of paper, implicit: does not stretch, bends like a plate"),
)


def is_mesh(_self: bpy.types.PropertyGroup, sheet: bpy.types.Object) -> bool:
    """Whether an object can be a burnt sheet."""
    return sheet.type == "MESH"


def sheet_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The sheet that panels and buttons are about: the active mesh, or the one that it is the burnt self of."""
    active = context.object
    if active is None or active.type != "MESH":
        return None
    return active.charcloth.sheet or active


class SheetSettings(bpy.types.PropertyGroup):
    """How a mesh burns."""

    preset: EnumProperty(
        name="Material", items=[(key, preset.label, preset.about) for key, preset in PRESETS.items()], default="film"
    )
    sparks: PointerProperty(
        name="Sparks", type=bpy.types.Collection, description="Empties that light the sheet where they touch it"
    )
    ignite: StringProperty(
        name="Lit Group", description="Vertex group or painted attribute that is lit where it is over one half"
    )
    pin: StringProperty(
        name="Pin Group", description="Vertex group or painted attribute that is held where it is over one half"
    )
    wind: FloatVectorProperty(name="Wind", description="Speed of the air [m/s]", size=3, default=(0, 0, 0))
    gust: FloatProperty(name="Gusts", description="How much gusts add to the wind or take away", min=0, soft_max=1)
    gravity: FloatProperty(name="Gravity", description="Weight, along -Z [m/s2]", default=9.81, soft_min=0)
    frame_start: IntProperty(name="Start", description="Frame at which the sheet lies as it is modelled", default=1)
    frame_end: IntProperty(name="End", description="Last frame to simulate", default=193)
    integrator: EnumProperty(name="Motion", items=INTEGRATORS, default="symplectic_euler")
    refine: BoolProperty(
        name="Refine",
        default=True,
        description="Divide faces that are larger than the spacing. Off: the mesh burns as it is",
    )
    spacing: FloatProperty(
        name="Spacing",
        default=0.0035,
        min=1e-4,
        soft_max=0.02,
        precision=4,
        step=0.05,
        description="Distance of points [m]; half of it takes eight times as long",
    )
    overrides: StringProperty(
        name="More Keys",
        description="Further keys of the scene, with semicolons between: fire.cooling_rate=0.5; shell.thickness=0.2 mm",
    )
    folder: StringProperty(
        name="Output", subtype="DIR_PATH", default="//charcloth/", description="A folder in it is made for the object"
    )
    # What the add-on notes for itself.
    state: StringProperty(default="", options={"HIDDEN"})
    message: StringProperty(default="", options={"HIDDEN"})
    progress: FloatProperty(default=0.0, options={"HIDDEN"})
    burnt: PointerProperty(type=bpy.types.Object, poll=is_mesh, options={"HIDDEN"})
    sheet: PointerProperty(type=bpy.types.Object, poll=is_mesh, options={"HIDDEN"})  # of the burnt one: what it was


class SparkSettings(bpy.types.PropertyGroup):
    """When and how an empty lights what it touches."""

    frame: IntProperty(name="Frame", description="Frame at which it lights; before the start: at the start", default=0)
    length: FloatProperty(name="Length", description="How long the flame is held there [s]", default=0.5, min=0.0)
    temperature: FloatProperty(
        name="Temperature", description="How hot the flame makes the sheet [K]", default=1100.0, min=300.0
    )


CLASSES = (SheetSettings, SparkSettings)


def register() -> None:
    """Makes the settings known and gives each object its own."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.charcloth = PointerProperty(type=SheetSettings)
    bpy.types.Object.charcloth_spark = PointerProperty(type=SparkSettings)


def unregister() -> None:
    """Takes them back."""
    del bpy.types.Object.charcloth_spark
    del bpy.types.Object.charcloth
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
