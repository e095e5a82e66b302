"""The add-on, installed from its archive, burns planes in Blender without a window, and what it loads is the run: one as a
sketch, then one of a measured material, with flames and ash.

Arguments: archive of the add-on, the charcloth program, a folder to write into.
"""

import sys
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
from mathutils import Vector
from reading import attribute, cache_frame, check_frames, evaluated

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
assert (settings.preset, settings.burn_level) == ("copy_paper_80", 2), "measured paper unless another is chosen"
settings.preset = "film"
assert settings.burn_level == 0 and np.isclose(settings.spacing, 0.0035), "spacing goes with the material"
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



class Layout:
    """Takes what panels draw where there is no window, and looks whether it is there to be drawn."""

    drawn: list[str] = []

    def prop(self, data: bpy.types.PropertyGroup, name: str, **_: object) -> None:
        assert name in data.bl_rna.properties, name
        self.drawn.append(name)

    def prop_search(self, data: bpy.types.PropertyGroup, name: str, there: object, names: str, **_: object) -> None:
        assert hasattr(there, names)
        self.prop(data, name)

    def operator(self, name: str, **_: object) -> None:
        bpy.ops.charcloth.__getattr__(name.removeprefix("charcloth.")).get_rna_type()
        self.drawn.append(name)

    def label(self, text: str = "", **_: object) -> None:
        self.drawn.append(text)

    def progress(self, **_: object) -> None:
        self.drawn.append("progress")

    def row(self, **_: object) -> "Layout":
        return self

    column = row


def draw_panels() -> list[str]:
    """Draws all panels of the active object, and says what is on them."""
    Layout.drawn = []
    for kind in sys.modules["bl_ext.user_default.charcloth.panel"].CLASSES:
        if kind.poll(bpy.context):
            panel = SimpleNamespace(layout=Layout(), fill=lambda layout, sheet, kind=kind: kind.fill(None, layout, sheet))
            kind.draw(panel, bpy.context)
    return Layout.drawn


bpy.context.view_layer.objects.active = sheet
drawn = draw_panels()
assert {"preset", "pin", "wind", "table", "obstacles", "spacing", "charcloth.burn"} <= set(drawn), drawn
assert not {"flames", "speed", "noburn"} & set(drawn), "sketches have no flames"
assert any("was not found" in words for words in drawn), "what went wrong last stands in the panel"
settings.preset = "denim"
assert {"flames", "voxel", "speed", "noburn"} <= set(draw_panels()), Layout.drawn
settings.preset, settings.spacing = "film", 0.005
bpy.context.view_layer.objects.active = spark
assert draw_panels() == ["frame", "length", "temperature"]

# As with a window: the job is looked at from time to time, cancelled in mid-run, and gone on with.
operators = sys.modules["bl_ext.user_default.charcloth.operators"]
settings.frame_end = START + 1000
job = operators.start(sheet, scene, resume=False)
while not job.frame and not job.poll():
    operators.show(sheet, job)
    bpy.context.view_layer.objects.active = sheet
    assert "progress" in draw_panels() and "charcloth.cancel" in Layout.drawn
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
for name in ("char", "ash", "kelvin", "rest"):
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

# Tissue with flames and ash, over a table and beside a box. It hangs 1 cm over the table, 50 x 60 mm.
LAST = 24
bpy.ops.mesh.primitive_cube_add(size=0.2, location=(2, 2, 0.2))
box = bpy.context.object
bpy.ops.mesh.primitive_plane_add(size=1, rotation=(np.pi / 2, 0, 0), location=(0, 0, 0.4))
sheet = bpy.context.object
sheet.name, sheet.scale = "tissue", (0.5, 0.6, 1)
sheet.vertex_groups.new(name="held").add([2, 3], 1.0, "REPLACE")
sheet.vertex_groups.new(name="keep").add([2, 3], 0.8, "REPLACE")
settings = sheet.charcloth
settings.preset = "tissue"
settings.folder, settings.pin, settings.noburn = folder, "held", "keep"
settings.frame_start, settings.frame_end, settings.voxel = START, START + LAST, 0.003
settings.table, settings.obstacles = True, bpy.data.collections.new("Things")
settings.obstacles.objects.link(box)
scene.cursor.location = (-0.25, 0, 0.1)
bpy.ops.charcloth.add_spark()
assert burn() == {"FINISHED"}, settings.message
run = Path(folder) / "tissue" / "run"
check_frames(settings.burnt, run, START, LAST, reads="all")
burnt, ash, fire = settings.burnt, settings.ash, settings.fire
assert (burnt.type, ash.type, fire.type) == ("MESH", "POINTCLOUD", "VOLUME")
shed = burning = 0
for number in range(LAST + 1):
    frame, _, _ = cache_frame(run, number)
    scene.frame_set(START + number)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    # Each particle is a scrap where the cache has it, as large as it was sheet, and moves as it did.
    geometry = ash.evaluated_get(depsgraph).evaluated_geometry()
    scraps = geometry.mesh
    count = len(frame["particle_mass"])
    corners = len(scraps.vertices) if scraps else 0
    assert corners == 8 * count, (number, corners, count)
    if count:
        radius = np.sqrt(frame["particle_area"] / np.pi)
        middle = attribute(scraps, "position").reshape(count, 8, 3).mean(1)
        assert (np.linalg.norm(middle - frame["particle_position"], axis=1) < 0.6 * radius + 1e-6).all(), number
        assert np.allclose(attribute(scraps, "kelvin").reshape(count, 8)[:, 0], frame["particle_temperature"])
        assert len(attribute(scraps, "velocity")) == corners, "blurred by its motion"
    shed = max(shed, count)
    # Flames are those of the frame, around what burns and above it.
    flames = fire.evaluated_get(depsgraph)
    assert Path(flames.data.grids.frame_filepath).name == f"flames_{number:05}.vdb", flames.data.grids.frame_filepath
    assert flames.data.grids.load()
    roots = frame["position"][(frame["burn_rate"] > 0) & (frame["flame"] > 0)] / METRES
    if len(roots):
        there = np.array([flames.matrix_world @ Vector(corner) for corner in flames.bound_box])
        assert (there.min(0) <= roots.min(0)).all() and (there.max(0) >= roots.max(0)).all(), number
        assert (there.max(0) < roots.max(0) + (0.5, 0.5, 2.0)).all(), (there, roots.max(0))
        burning += 1
assert shed > 0 and burning > LAST // 2, (shed, burning)
fresh, _, _ = cache_frame(run, 0)
end, _, _ = cache_frame(run, LAST)
assert end["noburn"].max() == 1 and not end["charred"][end["noburn"] == 1].any()
text = (Path(folder) / "tissue" / "scene.toml").read_text()
assert 'material = "tissue"' in text and text.count("[[obstacle]]") == 2, text

scene.frame_set(START + LAST)
scene.camera.location = (0, -1.6, 0.7)
burnt.hide_render = ash.hide_render = True
fire.hide_render = True
dark = picture()
fire.hide_render = False
red, green, blue = np.moveaxis(picture() - dark, 2, 0)
shining = red > 0.2
assert shining.sum() > 20 and (red >= green)[shining].all() and (green >= blue)[shining].all(), "fire is red to yellow"

bpy.context.view_layer.objects.active = sheet
bpy.ops.charcloth.unload()
assert not bpy.data.volumes and not bpy.data.pointclouds and not bpy.data.cache_files
print("SOUND", faces, shed, burning)
