"""Blender imports what `charcloth export` wrote: USD with all attributes, Alembic with colours.

Arguments: folder of a run with its exports in `usd` and `abc`, number of its last frame.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from reading import attribute, check_frames, evaluated

run, last = Path(sys.argv[1]), int(sys.argv[2])


def imported(path: Path) -> bpy.types.Object:
    """The one mesh of a file, in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix == ".abc":
        bpy.ops.wm.alembic_import(filepath=str(path), always_add_cache_reader=True)
    else:
        bpy.ops.wm.usd_import(filepath=str(path))
    (sheet,) = (thing for thing in bpy.data.objects if thing.type == "MESH")
    assert [modifier.type for modifier in sheet.modifiers] == ["MESH_SEQUENCE_CACHE"]
    assert np.allclose(sheet.matrix_world, np.eye(4), atol=1e-6)
    assert bpy.context.scene.frame_end == last
    return sheet


sheet = imported(run / "usd" / "sheet.usdc")
faces = check_frames(sheet, run, 0, last, reads="all")
assert len(set(faces)) > 4, faces
colors = attribute(evaluated(sheet, last), "displayColor")[:, :3]
weights = attribute(evaluated(sheet, last), "origin_weights")
assert np.allclose(weights.sum(1), 1, atol=1e-6) and (weights.max(1) < 0.75).any(), "points within faces of the input"
assert sheet.data.materials[0].name == "paper" and sheet.data.uv_layers[0].name == "st"

sheet = imported(run / "abc" / "sheet.abc")
assert check_frames(sheet, run, 0, last, reads="colors") == faces
mesh = evaluated(sheet, last)
names = {column.name for column in mesh.attributes}
assert {"Cd", "uv", "velocity"} <= names and not {"temperature", "char", "id", "origin_face", "origin_weights_a"} & names, names
# Colours go by corner there, in 8 bits. The importer takes the linear values for sRGB, so a shader that shall show
# them undoes that with a gamma of 1/2.2.
corners = np.zeros(len(mesh.loops), int)
mesh.loops.foreach_get("vertex_index", corners)
kept = np.array([corner.color_srgb[:3] for corner in mesh.attributes["Cd"].data])
assert np.abs(kept - colors[corners]).max() < 0.004
print("SOUND", faces)
