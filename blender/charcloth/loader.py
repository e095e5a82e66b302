"""The burnt sheet back in Blender: a mesh, particles and flames, each driven by the files of the run."""

from pathlib import Path

import bpy

from .ash import ash_material, give_shape
from .attributes import add_copies
from .fire import fire_material
from .material import burn_material
from .scene_file import last_frame, metres_per_unit, run_folder, wants_flames


def export_file(sheet: bpy.types.Object) -> Path:
    """The file that Blender reads."""
    return run_folder(sheet) / "usd" / "sheet.usdc"


def flame_files(sheet: bpy.types.Object) -> list[Path]:
    """The flames of each frame, in order."""
    return sorted((run_folder(sheet) / "vdb").glob("flames_*.vdb"))


def load(sheet: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object:
    """Loads the export of a sheet, in place of an earlier one, and hides the sheet."""
    path = export_file(sheet)
    if not path.is_file():
        raise ValueError(f"there is no file {path}; burn the sheet first")
    settings = sheet.charcloth
    remove_burnt(sheet)
    burnt, ash = _import(path)
    for thing, name in ((burnt, "burnt"), (ash, "ash")):
        if thing is None:
            continue
        thing.name = f"{sheet.name} {name}"
        # The file counts in metres, whatever a unit of the scene is.
        thing.scale = [1 / metres_per_unit(scene)] * 3
        cache = next(modifier for modifier in thing.modifiers if modifier.type == "MESH_SEQUENCE_CACHE")
        cache.cache_file.frame_offset = settings.frame_start
        _gather(thing, sheet)
    add_copies(burnt)
    _paint(burnt, burn_material(sheet))
    if ash is not None:
        give_shape(ash, ash_material(sheet))
    settings.burnt, settings.ash, burnt.charcloth.sheet = burnt, ash, sheet
    if wants_flames(settings):
        settings.fire = _load_flames(sheet, scene)
    sheet.hide_set(True)
    sheet.hide_render = True
    scene.frame_set(scene.frame_current)
    return burnt


def remove_burnt(sheet: bpy.types.Object) -> None:
    """Removes what was loaded before, and shows the sheet again."""
    settings = sheet.charcloth
    sheet.hide_set(False)
    sheet.hide_render = False
    caches = []
    for key in ("burnt", "ash", "fire"):
        thing = getattr(settings, key)
        setattr(settings, key, None)
        if thing is None:
            continue
        data = thing.data
        caches += [m.cache_file for m in thing.modifiers if m.type == "MESH_SEQUENCE_CACHE" and m.cache_file]
        bpy.data.objects.remove(thing)
        if data.users == 0:
            bpy.data.batch_remove([data])
    # A cache file keeps its archive open: a new burn needs a new one.
    unused = {cache for cache in caches if cache.users == 0}
    if unused:
        bpy.data.batch_remove(list(unused))


def _load_flames(sheet: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """A volume of the flames, frame by frame where the sheet is."""
    files = flame_files(sheet)
    if not files:
        return None
    volume = bpy.data.volumes.new(f"{sheet.name} flames")
    volume.filepath = str(files[0])
    volume.is_sequence = True
    volume.sequence_mode = "CLIP"
    # The first file is that of frame 0 of the run.
    volume.frame_start = sheet.charcloth.frame_start
    volume.frame_duration = max(len(files), last_frame(sheet.charcloth) + 1)
    volume.frame_offset = -1
    flames = bpy.data.objects.new(volume.name, volume)
    flames.scale = [1 / metres_per_unit(scene)] * 3
    _gather(flames, sheet)
    volume.materials.append(fire_material(sheet))
    return flames


def _gather(thing: bpy.types.Object, sheet: bpy.types.Object) -> None:
    """Puts an object where the sheet is."""
    for collection in thing.users_collection:
        collection.objects.unlink(thing)
    for collection in sheet.users_collection:
        collection.objects.link(thing)


def _paint(thing: bpy.types.Object, material: bpy.types.Material) -> None:
    thing.data.materials.clear()
    thing.data.materials.append(material)


def _import(path: Path) -> tuple[bpy.types.Object, bpy.types.Object | None]:
    """The mesh of a file, and its points if it has some."""
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
    fresh = [thing for thing in bpy.data.objects if thing not in before]
    meshes, points = ([thing for thing in fresh if thing.type == kind] for kind in ("MESH", "POINTCLOUD"))
    if len(meshes) != 1 or len(points) > 1:
        raise ValueError(f"{path} has {len(meshes)} meshes and {len(points)} sets of points")
    return meshes[0], next(iter(points), None)
