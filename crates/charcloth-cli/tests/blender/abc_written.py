"""Blender exports a mesh as Alembic; and the same is written as OBJ, y up.

Argument: folder to write into.
"""

import sys
from pathlib import Path

import bpy

folder = Path(sys.argv[1])

bpy.ops.wm.read_factory_settings(use_empty=True)
parent = bpy.data.objects.new("parent", None)
bpy.context.scene.collection.objects.link(parent)
parent.location, parent.scale = (0.02, 0.03, 0.05), (1.5, 1, 1)
place = {"location": (0.1, 0.2, 0.3), "rotation": (0.4, 0.5, 0.6)}
bpy.ops.mesh.primitive_grid_add(x_subdivisions=7, y_subdivisions=5, size=2, **place)
sheet = bpy.context.object
sheet.scale, sheet.parent = (0.105, 0.15, 1), parent
mesh = sheet.data
# No face is a rectangle: which way one is cut in two must not hang on the last bit.
for vertex in mesh.vertices:
    vertex.co.x += 0.3 * vertex.co.y
    vertex.co.z += 0.2 * vertex.co.x**2
bpy.context.view_layer.update()

assert bpy.ops.wm.alembic_export(filepath=str(folder / "sheet.abc"), end=1) == {"FINISHED"}

with open(folder / "expected.obj", "w") as out:
    for vertex in mesh.vertices:
        there = sheet.matrix_world @ vertex.co
        out.write("v %.9g %.9g %.9g\n" % (there.x, there.z, -there.y))
    for corner in mesh.uv_layers[0].uv:
        out.write("vt %.9g %.9g\n" % tuple(corner.vector))
    for face in mesh.polygons:
        corners = [f"{mesh.loops[k].vertex_index + 1}/{k + 1}" for k in face.loop_indices]
        out.write("f " + " ".join(corners) + "\n")
print("SOUND")
