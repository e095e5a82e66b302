"""The burnt sheet back in Blender: an object that a mesh sequence cache drives."""

from pathlib import Path

import bpy

from .attributes import add_copies
from .material import burn_material
from .scene_file import metres_per_unit, run_folder


def export_file(sheet: bpy.types.Object) -> Path:
    """The file that Blender reads."""
    return run_folder(sheet) / "usd" / "sheet.usdc"


def load(sheet: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object:
    """Loads the export of a sheet, in place of an earlier one, and hides the sheet."""
    path = export_file(sheet)
    if not path.is_file():
        raise ValueError(f"there is no file {path}; burn the sheet first")
    settings = sheet.charcloth
    collections = sheet.users_collection
    remove_burnt(sheet)
    burnt = _import(path)
    burnt.name = f"{sheet.name} burnt"
    for collection in burnt.users_collection:
        collection.objects.unlink(burnt)
    for collection in collections:
        collection.objects.link(burnt)
    # The file counts in metres, whatever a unit of the scene is.
    burnt.scale = [1 / metres_per_unit(scene)] * 3
    cache = next(modifier for modifier in burnt.modifiers if modifier.type == "MESH_SEQUENCE_CACHE")
    cache.cache_file.frame_offset = settings.frame_start
    add_copies(burnt)
    burnt.data.materials.clear()
    burnt.data.materials.append(burn_material(sheet))
    settings.burnt, burnt.charcloth.sheet = burnt, sheet
    sheet.hide_set(True)
    sheet.hide_render = True
    scene.frame_set(scene.frame_current)
    return burnt


def remove_burnt(sheet: bpy.types.Object) -> None:
    """Removes what was loaded before, and shows the sheet again."""
    burnt = sheet.charcloth.burnt
    sheet.hide_set(False)
    sheet.hide_render = False
    if burnt is None:
        return
    mesh = burnt.data
    files = [m.cache_file for m in burnt.modifiers if m.type == "MESH_SEQUENCE_CACHE" and m.cache_file]
    bpy.data.objects.remove(burnt)
    if mesh.users == 0:
        bpy.data.meshes.remove(mesh)
    # A cache file keeps its archive open: a new burn needs a new one.
    for file in files:
        if file.users == 0:
            bpy.data.batch_remove([file])
    sheet.charcloth.burnt = None


def _import(path: Path) -> bpy.types.Object:
    before = set(bpy.data.objects)
    bpy.ops.wm.usd_import(
        filepath=str(path),
        scale=1.0,
        apply_unit_conversion_scale=False,
        set_frame_range=False,
        import_materials=False,
        import_cameras=False,
        import_lights=False,
    )
    found = [thing for thing in bpy.data.objects if thing not in before and thing.type == "MESH"]
    if len(found) != 1:
        raise ValueError(f"{path} has {len(found)} meshes")
    return found[0]
