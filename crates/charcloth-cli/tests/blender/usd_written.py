"""Blender exports a mesh as USD, z-up, turned to y-up and packed; and the same is written as OBJ in metres, y up.

Argument: folder to write into.
"""

import sys
from pathlib import Path

import bpy

folder = Path(sys.argv[1])

bpy.ops.wm.read_factory_settings(use_empty=True)
place = {"location": (0.1, 0.2, 0.3), "rotation": (0.4, 0.5, 0.6)}
bpy.ops.mesh.primitive_grid_add(x_subdivisions=7, y_subdivisions=5, size=2, **place)
sheet = bpy.context.object
sheet.scale = (0.105, 0.15, 1)
mesh = sheet.data
# No face is a rectangle: which way one is cut in two must not hang on the last bit.
for vertex in mesh.vertices:
    vertex.co.x += 0.3 * vertex.co.y
    vertex.co.z += 0.2 * vertex.co.x**2
pin = mesh.attributes.new("pin", "FLOAT", "POINT")
paint = mesh.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
for k in range(len(mesh.vertices)):
    # Single precision holds them.
    pin.data[k].value = k / 64
    paint.data[k].color = (k / 128, 0.5, 0, 1)
bpy.context.view_layer.update()

for name, turned in [("z_up.usdc", False), ("y_up.usda", True), ("package.usdz", False)]:
    done = bpy.ops.wm.usd_export(filepath=str(folder / name), convert_orientation=turned)
    assert done == {"FINISHED"} and (folder / name).exists(), (name, done)

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
