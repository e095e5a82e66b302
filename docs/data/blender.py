"""docs/pictures/blender.png: a sheet burnt by the add-on, as it comes, rendered in Cycles. Needs a Python that has bpy.

    python3 blender/package.py FOLDER
    python3 docs/data/blender.py ARCHIVE PROGRAM FOLDER PICTURE [FRAME [LAST]]

Copy paper of 100 x 140 mm held by its upper corners and lit at its lower left one, with the spacing and the materials that the
add-on gives it. Frames from 1 at 24 a second.
"""

import sys

import bpy
import numpy as np

archive, program, folder, picture = sys.argv[1:5]
frame, last = [int(a) for a in sys.argv[5:7]] or [100, 120]

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
bpy.context.preferences.addons["bl_ext.user_default.charcloth"].preferences.program = program
scene = bpy.context.scene
scene.render.fps = 24
bpy.ops.mesh.primitive_plane_add(size=1, rotation=(np.pi / 2, 0, 0), location=(0, 0, 0.2))
sheet = bpy.context.object
sheet.name, sheet.scale = "letter", (0.1, 0.14, 1)
bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.subdivide(number_cuts=27)
bpy.ops.object.mode_set(mode="OBJECT")
held = [v.index for v in sheet.data.vertices if v.co.z > 0.266 and abs(v.co.x) > 0.046]
sheet.vertex_groups.new(name="held").add(held, 1.0, "REPLACE")
settings = sheet.charcloth
settings.folder, settings.pin = folder, "held"
settings.frame_start, settings.frame_end = 1, last
scene.cursor.location = (-0.05, 0, 0.13)
bpy.ops.charcloth.add_spark()
spark = settings.sparks.objects[0]
spark.empty_display_size = 0.008
spark.charcloth_spark.length = 1.5
bpy.context.view_layer.objects.active = sheet
sheet.select_set(True)
assert bpy.ops.charcloth.burn() == {"FINISHED"}, settings.message
print(settings.message)

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
scene.camera = camera
camera.location, camera.rotation_euler = (0.12, -0.42, 0.205), (np.pi / 2, 0, 0.27)
camera.data.lens = 60
for power, place, turn in [(2.2, (-0.3, -0.5, 0.6), (0.9, 0, -0.5)), (0.8, (0.4, 0.3, 0.5), (-0.9, 0, 2.2))]:
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "AREA"))
    lamp.data.energy, lamp.data.size = power, 0.3
    lamp.location, lamp.rotation_euler = place, turn
    scene.collection.objects.link(lamp)
scene.world = bpy.data.worlds.new("room")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.012, 0.014, 0.018, 1)
scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 96
scene.cycles.use_denoising = True
scene.render.use_motion_blur = True
scene.render.resolution_x, scene.render.resolution_y = 640, 720
scene.view_settings.view_transform = "AgX"
scene.frame_set(frame)
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)
bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/sheet.blend")
