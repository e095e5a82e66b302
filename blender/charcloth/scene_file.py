"""The scene as the program reads it: settings of a sheet and its sparks as TOML (docs/scenes.md), in SI units."""

import json
from pathlib import Path
from typing import Any

import bpy

from .mesh_file import write_sheet
from .presets import PHYSICAL, PRESETS

MESH = "sheet.ply"
SCENE = "scene.toml"
SHELL_STEP = 0.01  # [s]; docs/scenes.md: 5 to 15 ms do
BURNING_STEP = 0.004  # [s]; as the built-in scenes of the physical model
SHELL_TOLERANCE = 0.01  # docs/scenes.md: looks as 0.001 does and costs less


def run_folder(sheet: bpy.types.Object) -> Path:
    """Folder of an object's burn: mesh, scene, run and export."""
    settings = sheet.charcloth
    if settings.folder.startswith("//") and not bpy.data.filepath:
        raise ValueError("save the file first, or choose an output folder that does not start with //")
    return Path(bpy.path.abspath(settings.folder)).resolve() / bpy.path.clean_name(sheet.name)


def frames_per_second(scene: bpy.types.Scene) -> float:
    """Frames a second of a scene."""
    return scene.render.fps / scene.render.fps_base


def last_frame(settings: bpy.types.PropertyGroup) -> int:
    """Number of frames after the first."""
    return max(settings.frame_end - settings.frame_start, 1)


def metres_per_unit(scene: bpy.types.Scene) -> float:
    """Length of a unit of the scene [m]."""
    return scene.unit_settings.scale_length


def write_scene(sheet: bpy.types.Object, scene: bpy.types.Scene) -> Path:
    """Writes mesh and scene, as they are at the first frame, into the folder of the sheet; returns the scene file."""
    folder = run_folder(sheet)
    folder.mkdir(parents=True, exist_ok=True)
    settings = sheet.charcloth
    groups = (("pin", settings.pin), ("ignite", settings.ignite), ("noburn", settings.noburn if physical(settings) else ""))
    weights = {layer: name for layer, name in groups if name}
    spacing = settings.spacing if settings.refine else 0.0
    with FirstFrame(sheet, scene):
        write_sheet(sheet, folder / MESH, metres_per_unit(scene), weights, spacing)
        for number, thing in enumerate(obstacles(sheet)):
            write_sheet(thing, folder / obstacle_file(number), metres_per_unit(scene), {}, 0.0)
        text = scene_text(sheet, scene)
    path = folder / SCENE
    path.write_text(text, encoding="utf-8")
    return path


def physical(settings: bpy.types.PropertyGroup) -> bool:
    """Whether the material is a measured one."""
    return PRESETS[settings.preset].model == PHYSICAL


def wants_flames(settings: bpy.types.PropertyGroup) -> bool:
    """Whether there will be flames to load."""
    return settings.flames and physical(settings)


def scene_text(sheet: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """The scene of a sheet, as TOML."""
    settings = sheet.charcloth
    fps = frames_per_second(scene)
    integrator = settings.integrator
    if integrator == "material":
        integrator = "implicit" if physical(settings) else "symplectic_euler"
    tables: dict[str, dict[str, Any]] = {
        "": {"name": sheet.name, "model": PRESETS[settings.preset].model, "up": "z", "gravity": settings.gravity},
        "sheet": {"mesh": MESH, "burn_level": settings.burn_level},
        "mechanics": {"integrator": integrator},
        "wind": {"velocity": list(settings.wind), "gust": settings.gust},
        "time": {"frames": last_frame(settings), "fps": fps},
        "output": {"stills": []},
    }
    if integrator == "implicit":
        tables["shell"] = {"newton_tolerance": SHELL_TOLERANCE}
        tables["time"]["step"] = BURNING_STEP if physical(settings) else SHELL_STEP
    if physical(settings):
        tables["fire"] = {"speed_gain": settings.speed}
    if settings.self_contact:
        tables["contact"] = {"self_contact": True}
    for name, keys in PRESETS[settings.preset].keys.items():
        tables[name] = {**tables.get(name, {}), **keys}
    parts = [_table(f"[{name}]" if name else "", keys) for name, keys in tables.items()]
    if settings.noburn and physical(settings):
        parts.append(_table("[paint.noburn]", {"group": "noburn"}))
    if settings.table:
        height = metres_per_unit(scene) * settings.table_height
        parts.append(_table("[[obstacle]]", {"shape": "plane", "position": [0.0, 0.0, height]}))
    for number in range(len(obstacles(sheet))):
        parts.append(_table("[[obstacle]]", {"shape": "mesh", "mesh": obstacle_file(number)}))
    if settings.pin:
        parts.append(_table("[[pin]]", {"group": "pin"}))
    if settings.ignite:
        parts.append(_table("[[ignite]]", {"group": "ignite"}))
    parts += [_table("[[ignite]]", row) for row in spark_rows(sheet, scene)]
    return "\n".join(parts)


def obstacles(sheet: bpy.types.Object) -> list[bpy.types.Object]:
    """The meshes that a sheet falls on."""
    settings = sheet.charcloth
    things = settings.obstacles.all_objects if settings.obstacles else []
    others = [thing for thing in things if thing.type == "MESH" and thing not in (sheet, settings.burnt)]
    return sorted(others, key=lambda thing: thing.name)


def obstacle_file(number: int) -> str:
    """Name of the file of an obstacle."""
    return f"obstacle_{number}.ply"


def spark_rows(sheet: bpy.types.Object, scene: bpy.types.Scene) -> list[dict[str, Any]]:
    """A row for each empty among the sparks: its place and the radius at which it is drawn [m]."""
    sparks = sheet.charcloth.sparks
    metres = metres_per_unit(scene)
    rows = []
    for empty in sorted(sparks.all_objects, key=lambda empty: empty.name) if sparks else []:
        if empty.type != "EMPTY":
            continue
        place, _, scale = empty.matrix_world.decompose()
        spark = empty.charcloth_spark
        rows.append(
            {
                "point": [metres * x for x in place],
                "radius": metres * empty.empty_display_size * max(map(abs, scale)),
                "start": max(spark.frame - sheet.charcloth.frame_start, 0) / frames_per_second(scene),
                "length": spark.length,
                "temperature": spark.temperature,
            }
        )
    return rows


def override_arguments(settings: bpy.types.PropertyGroup) -> list[str]:
    """Further keys, as arguments of the program."""
    keys = [key.strip() for key in settings.overrides.split(";")]
    return [argument for key in keys if key for argument in ("--set", key)]


def _table(head: str, keys: dict[str, Any]) -> str:
    lines = [head] if head else []
    return "\n".join([*lines, *(f"{key} = {json.dumps(_plain(value))}" for key, value in keys.items()), ""])


def _plain(value: Any) -> Any:
    """A value without the noise of single precision: 0.0035, not 0.003499999875202775."""
    if isinstance(value, float):
        return float(f"{value:.7g}")
    return [_plain(item) for item in value] if isinstance(value, list) else value


class FirstFrame:
    """While it holds, the scene is at the first frame and the sheet is not hidden, so that Blender evaluates it."""

    def __init__(self, sheet: bpy.types.Object, scene: bpy.types.Scene) -> None:
        self.sheet, self.scene = sheet, scene
        self.before = (scene.frame_current, sheet.hide_viewport, sheet.hide_get())

    def __enter__(self) -> None:
        self.sheet.hide_viewport = False
        self.sheet.hide_set(False)
        self.scene.frame_set(self.sheet.charcloth.frame_start)

    def __exit__(self, *_: object) -> None:
        frame, hide_viewport, hidden = self.before
        self.sheet.hide_viewport = hide_viewport
        self.sheet.hide_set(hidden)
        self.scene.frame_set(frame)
