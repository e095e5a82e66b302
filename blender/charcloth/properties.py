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

from .presets import MEASURED, PRESETS, SKETCHES

INTEGRATORS = (
    ("", "Motion", ""),
    ("material", "By Material", "Measured materials move as shells, sketches as springs", 2),
    ("symplectic_euler", "Springs", "Soft sheet, explicit: quick to set up, stretches a little", 0),
    ("implicit", "Shell", "Sheet with the moduli of paper, implicit: does not stretch, bends like a plate", 1),
)
# By number in files, so that what is added does not change them.
MATERIALS = [
    ("", "Measured", "Chemistry, flames and mechanics of a real material"),
    *((key, row.label, row.about, 100 + number) for number, (key, row) in enumerate(MEASURED.items())),
    ("", "Sketch", "A glowing front at a speed that is put in, without flames"),
    *((key, row.label, row.about, number) for number, (key, row) in enumerate(SKETCHES.items())),
]


def refit(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Another material: what goes with it."""
    preset = PRESETS[settings.preset]
    settings.spacing, settings.burn_level = preset.spacing, preset.burn_level


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

    preset: EnumProperty(name="Material", items=MATERIALS, default="copy_paper_80", update=refit)
    speed: FloatProperty(
        name="Speed",
        description="How much faster than in nature fire spreads and burns out; of measured materials",
        default=1.0,
        min=0.02,
        max=50.0,
        soft_max=10.0,
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
    noburn: StringProperty(
        name="No-Burn Group",
        description="Vertex group or painted attribute that must not burn where it is over one half; of measured materials",
    )
    wind: FloatVectorProperty(name="Wind", description="Speed of the air [m/s]", size=3, default=(0, 0, 0))
    gust: FloatProperty(name="Gusts", description="How much gusts add to the wind or take away", min=0, soft_max=1)
    gravity: FloatProperty(name="Gravity", description="Weight, along -Z [m/s2]", default=9.81, soft_min=0)
    frame_start: IntProperty(name="Start", description="Frame at which the sheet lies as it is modelled", default=1)
    frame_end: IntProperty(name="End", description="Last frame to simulate", default=193)
    integrator: EnumProperty(name="Motion", items=INTEGRATORS, default="material")
    self_contact: BoolProperty(
        name="Self Contact",
        description="The sheet touches itself; with a table or obstacles it does in any case. Needs the shell",
    )
    table: BoolProperty(name="Table", description="A table, as wide as the world. Needs the shell")
    table_height: FloatProperty(
        name="Height",
        description="Height of the table; the sheet must lie above it, a millimetre does",
        subtype="DISTANCE",
    )
    obstacles: PointerProperty(
        name="Obstacles",
        type=bpy.types.Collection,
        description="Meshes that the sheet falls on, as they are at the first frame. Needs the shell",
    )
    flames: BoolProperty(
        name="Flames", default=True, description="Flames as a volume with a fire material; of measured materials"
    )
    voxel: FloatProperty(
        name="Voxel",
        default=0.002,
        min=0.0005,
        max=0.05,
        precision=4,
        step=0.05,
        description="Side of the voxels of flames [m]; half of it makes files of eight times the size",
    )
    refine: BoolProperty(
        name="Refine",
        default=True,
        description="Divide faces that are larger than the spacing. Off: the mesh burns as it is",
    )
    spacing: FloatProperty(
        name="Spacing",
        default=0.005,
        min=1e-4,
        soft_max=0.02,
        precision=4,
        step=0.05,
        description="Distance of points [m]; half of it takes eight times as long",
    )
    burn_level: IntProperty(
        name="Burn Level",
        default=2,
        min=0,
        max=3,
        description="How often the distance of points is halved for what burns, and what is seen",
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
    ash: PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    fire: PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    sheet: PointerProperty(type=bpy.types.Object, poll=is_mesh, options={"HIDDEN"})  # of the burnt one: what it was


class SparkSettings(bpy.types.PropertyGroup):
    """When and how an empty lights what it touches."""

    frame: IntProperty(name="Frame", description="Frame at which it lights; before the start: at the start", default=0)
    length: FloatProperty(name="Length", description="How long the flame is held there [s]", default=1.5, min=0.0)
    temperature: FloatProperty(
        name="Temperature", description="How hot the flame makes a sketched sheet [K]", default=1100.0, min=300.0
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
