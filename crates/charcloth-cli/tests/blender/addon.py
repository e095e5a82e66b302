"""The add-on, installed from its archive, burns a plane in Blender without a window, and what it loads is the run.

Arguments: archive of the add-on, the charcloth program, a folder to write into.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from reading import attribute, check_frames, evaluated

archive, program, folder = sys.argv[1:]

bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
addon = bpy.context.preferences.addons["bl_ext.user_default.charcloth"]
addon.preferences.program = program
scene = bpy.context.scene
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
# A unit is a decimetre: the plane of 0.6 x 0.8 units is 60 x 80 mm.
METRES = 0.1
scene.unit_settings.scale_length = METRES
START = 11

bpy.ops.mesh.primitive_plane_add(size=1, rotation=(np.pi / 2, 0, 0), location=(0, 0, 0.4))
sheet = bpy.context.object
sheet.name, sheet.scale = "letter", (0.6, 0.8, 1)
sheet.vertex_groups.new(name="held").add([2, 3], 1.0, "REPLACE")
settings = sheet.charcloth
settings.folder, settings.pin = folder, "held"
settings.frame_start, settings.frame_end = START, START + 24
settings.spacing = 0.005
settings.overrides = "fire.burn_time=0.2; fire.diffusivity=2e-4"
scene.cursor.location = (0.3, 0, 0)
bpy.ops.charcloth.add_spark()
spark = settings.sparks.objects[0]
spark.charcloth_spark.length = 0.3


def burn() -> set[str]:
    """Presses the button with the sheet active."""
    bpy.context.view_layer.objects.active = sheet
    return bpy.ops.charcloth.burn()


def fails(word: str) -> None:
    """Burns, which must go wrong and say why."""
    try:
        burn()
    except RuntimeError as error:
        assert word in str(error) and word in settings.message, (word, str(error), settings.message)
        return
    raise AssertionError(f"no word of {word}")


# What goes wrong is said in the words of the program, or before it starts.
settings.overrides += "; fire.burn_tyme=1"
fails("burn_time")
settings.overrides = settings.overrides.removesuffix("; fire.burn_tyme=1")
settings.pin = "nothing"
fails("nothing")
settings.pin = "held"
addon.preferences.program = "/nowhere/charcloth"
fails("preferences")
addon.preferences.program = program

# As with a window: the job is looked at from time to time, cancelled in mid-run, and gone on with.
operators = sys.modules["bl_ext.user_default.charcloth.operators"]
settings.frame_end = START + 1000
job = operators.start(sheet, scene, resume=False)
while not job.frame and not job.poll():
    operators.show(sheet, job)
    time.sleep(0.02)
bpy.context.view_layer.objects.active = sheet
bpy.ops.charcloth.cancel()
job.wait()
assert operators.conclude(sheet, scene, job) == "" and job.stopped and job.frame < 1000, job
assert "Resume" in settings.message and operators.can_resume(sheet) and settings.burnt is None
settings.frame_end = START + job.frame + 2
assert bpy.ops.charcloth.resume() == {"FINISHED"}, settings.message
check_frames(settings.burnt, Path(folder) / "letter" / "run", START, job.frame + 2, reads="all")
settings.frame_end = START + 24

assert burn() == {"FINISHED"}, settings.message
assert not settings.state and sheet.hide_get() and sheet.hide_render
burnt = settings.burnt
assert np.allclose(burnt.scale, 1 / METRES)
run = Path(folder) / "letter" / "run"
faces = check_frames(burnt, run, START, 24, reads="all")
assert len(set(faces)) > 4, ("the sheet does not burn away", faces)

# The first frame is where the plane was, in its units, and refined to the spacing.
first = evaluated(burnt, START)
points = attribute(first, "position") @ np.array(burnt.matrix_world.to_3x3()).T
assert np.allclose(points.min(0), (-0.3, 0, 0), atol=1e-4) and np.allclose(points.max(0), (0.3, 0, 0.8), atol=1e-4)
fresh = attribute(first, "char").max()
lengths = [np.linalg.norm(points[a] - points[b]) * METRES for a, b in (edge.vertices for edge in first.edges)]
assert 0.6 * 0.005 < np.median(lengths) < 1.5 * 0.005, np.median(lengths)
uv = np.zeros((len(first.loops), 2), np.float32)
first.uv_layers["st"].uv.foreach_get("vector", uv.ravel())
corners = np.zeros(len(first.loops), int)
first.loops.foreach_get("vertex_index", corners)
assert np.allclose(uv, (points[corners][:, [0, 2]] - (-0.3, 0)) / (0.6, 0.8), atol=1e-4), "places slide with their uv"

# What was held stayed, and what was lit is gone or black.
last = evaluated(burnt, START + 24)
there = attribute(last, "position")
assert np.isclose(there[:, 2].max(), 0.08, atol=1e-5)
assert attribute(last, "char").max() > 0.9 and fresh < 0.6

nodes = {(node.bl_idname, getattr(node, "attribute_name", "")) for node in burnt.data.materials[0].node_tree.nodes}
for name in ("char", "burn", "kelvin", "rest"):
    assert ("ShaderNodeAttribute", name) in nodes, name
assert ("ShaderNodeBlackbody", "") in nodes
assert np.array_equal(attribute(last, "kelvin"), attribute(last, "temperature"))

# Longer, from where it was; then again from the beginning, with the first one replaced.
settings.frame_end = START + 26
bpy.context.view_layer.objects.active = settings.burnt
assert bpy.ops.charcloth.resume() == {"FINISHED"}, settings.message
check_frames(settings.burnt, run, START, 26, reads="all")
settings.frame_end = START + 12
# Older versions kept no list of what they exported.
(Path(folder) / "letter" / "usd" / "export.json").unlink()
assert burn() == {"FINISHED"}, settings.message
assert len(bpy.data.cache_files) == 1 and len([o for o in bpy.data.objects if "burnt" in o.name]) == 1
check_frames(settings.burnt, run, START, 12, reads="all")

# A picture of it, blurred by motion.
burnt = settings.burnt
scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(scene.camera)
scene.camera.location, scene.camera.rotation_euler = (0, -1.6, 0.4), (np.pi / 2, 0, 0)
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.rotation_euler = (0.8, 0, 0.4)
scene.collection.objects.link(sun)
scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
scene.render.resolution_x = scene.render.resolution_y = 64
scene.view_settings.view_transform = "Standard"
moving = next(k for k in range(4, 12) if faces[k - 1] != faces[k] != faces[k + 1])
scene.frame_set(START + moving)


def picture() -> np.ndarray:
    """The frame as rendered, red green blue."""
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    return np.array(image.pixels).reshape(64, 64, 4)[..., :3]


def given_velocity(metres_per_second: float) -> np.ndarray:
    """The frame as rendered if all of the sheet fell at this speed."""
    tree = bpy.data.node_groups.new("fall", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type = "FLOAT_VECTOR"
    store.inputs["Name"].default_value = "velocity"
    value = next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled)
    value.default_value = (0, 0, -metres_per_second)
    tree.links.new(tree.nodes.new("NodeGroupInput").outputs[0], store.inputs["Geometry"])
    tree.links.new(store.outputs["Geometry"], tree.nodes.new("NodeGroupOutput").inputs[0])
    modifier = burnt.modifiers.new("fall", "NODES")
    modifier.node_group = tree
    seen = picture()
    burnt.modifiers.remove(modifier)
    return seen


scene.render.filepath = str(Path(folder) / "picture.png")
scene.render.use_motion_blur = True
blurred = picture()
fallen = np.abs(given_velocity(1.0) - given_velocity(0.0)).max()
assert fallen > 0.1, ("what moves is blurred by its velocity, also where faces change", fallen)
assert blurred.std() > 0.05, blurred.std()
red, blue = blurred[..., 0], blurred[..., 2]
assert (red > 0.3).sum() > 300, "paper"
assert ((red > 1.3 * blue) & (red > 0.1)).sum() > 8, "scorch and glow"

bpy.context.view_layer.objects.active = sheet
bpy.ops.charcloth.unload()
assert settings.burnt is None and not sheet.hide_get() and not bpy.data.cache_files
print("SOUND", faces)
