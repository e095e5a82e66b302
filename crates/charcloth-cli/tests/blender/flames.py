"""Blender loads flames that `charcloth export` wrote, where the run has them, and Cycles renders them.

Argument: folder of a run, z-up, with flames of its frames 18 to 20 in `vdb`.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from reading import cache_frame

run = Path(sys.argv[1])
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
assert bpy.ops.object.volume_import(filepath=str(run / "vdb" / "flames_00018.vdb")) == {"FINISHED"}
flames = bpy.context.object
for number in (18, 19, 20):
    flames.data.filepath = str(run / "vdb" / f"flames_{number:05}.vdb")
    assert flames.data.grids.load()
    assert [grid.name for grid in flames.data.grids] == ["flame", "temperature"]
    frame, _, _ = cache_frame(run, number)
    roots = frame["position"][(frame["burn_rate"] > 0) & (frame["flame"] > 0)]
    bpy.context.view_layer.update()
    box = np.array([flames.matrix_world @ Vector(corner) for corner in flames.bound_box])
    low, high = box.min(0), box.max(0)
    # Around all that burns, a little below it and a few centimetres above.
    assert (low <= roots.min(0)).all() and (low > roots.min(0) - 0.03).all(), (low, roots.min(0))
    assert (high[:2] >= roots.max(0)[:2]).all() and (high[:2] < roots.max(0)[:2] + 0.05).all(), (high, roots.max(0))
    assert 0.005 < high[2] - roots.max(0)[2] < 0.2, (high, roots.max(0))

# The shader of docs/pipeline.md.
material = bpy.data.materials.new("flames")
material.use_nodes = True
nodes, links = material.node_tree.nodes, material.node_tree.links
nodes.clear()
info, black_body = nodes.new("ShaderNodeVolumeInfo"), nodes.new("ShaderNodeBlackbody")
strength, emission = nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeEmission")
strength.operation, strength.inputs[1].default_value = "MULTIPLY", 1000
links.new(info.outputs["Flame"], strength.inputs[0])
links.new(info.outputs["Temperature"], black_body.inputs["Temperature"])
links.new(strength.outputs[0], emission.inputs["Strength"])
links.new(black_body.outputs["Color"], emission.inputs["Color"])
links.new(emission.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
flames.data.materials.append(material)
camera = scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
middle = Vector((low + high) / 2)
camera.location = middle + Vector((0, -0.5, 0))
camera.rotation_euler = (np.pi / 2, 0, 0)
camera.data.type, camera.data.ortho_scale = "ORTHO", 0.25
scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 8
scene.render.resolution_x = scene.render.resolution_y = 64
scene.view_settings.view_transform = "Standard"
scene.render.filepath = str(run / "flames.png")
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath, check_existing=False)
red, green, blue = (np.array(image.pixels).reshape(64, 64, 4)[..., k] for k in range(3))
shining = red > 0.5
assert 10 < shining.sum() < 2000, shining.sum()
assert (red >= green).all() and (green >= blue)[shining].all(), "fire is red to yellow"
print("SOUND", shining.sum())
