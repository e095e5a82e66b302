"""A sheet that folds on itself: time, strain and crossings of Charcloth and of Blender's cloth with self-collision.

    python3 self_contact.py --charcloth target/release/charcloth --blender PYTHON_WITH_BPY --segments 128 --csv self_contact.csv

A square of soft cloth, 210 mm, 150 g/m2, 200 N/m a width, slightly wavy, stands on a table by its lower edge, buckles and
folds. Both get the same mesh. Crossing pairs of triangles of Blender's frames are counted by Charcloth, exactly.
Needs numpy; Blender's cloth needs a Python that has bpy 5.0.1.
"""

import json
import shutil
from pathlib import Path

import numpy as np
from work_precision import command_line, peer, printed, rounded, run, write

SIDE = 0.21
STIFFNESS = 200.0  # [N/m]
GRAMMAGE = 0.15  # [kg/m2]
GAP = 1e-3  # under its lower edge [m]


def sheet(segments):
    """Places (x, y up, z) and triangles of the wavy square."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, segments + 1), np.linspace(0, 1, segments + 1))
    wave = 0.5e-3 * np.sin(5.3 * v) * np.cos(2.0 * u)
    places = np.stack([SIDE * u, SIDE * v + GAP, wave], -1).reshape(-1, 3)
    corner = np.arange(segments)[:, None] * (segments + 1) + np.arange(segments)
    a, b, c, d = (corner + k for k in (0, 1, segments + 2, segments + 1))
    return places, np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


def write_mesh(path, places, triangles):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in places] + [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    Path(path).write_text("\n".join(lines) + "\n")


SCENE = """
name = "self_contact"
wind.coefficient = 0.0
thermal_force.law = "off"
curl.law = "off"
[sheet]
mesh = "{mesh}"
grammage = "150 g/m2"
variation.noise = 0.0
[mechanics]
integrator = "implicit"
damping = 0.5
moves = {moves}
[shell]
thickness = "0.5 mm"
modulus_along = "0.4 MPa"
modulus_across = "0.4 MPa"
poisson = 0.2
newton_tolerance = {newton}
[time]
frames = {frames}
step = "{step} ms"
{contact}
"""
CONTACT = """
[contact]
friction = 0.5
[[obstacle]]
shape = "plane"
"""


def scene(arguments, mesh, **keys):
    path = Path(arguments.scratch) / "scene.toml"
    path.write_text(SCENE.format(**{"mesh": mesh, "moves": "true", "newton": 1e-2, "step": 14, "contact": CONTACT, **keys}))
    return str(path)


def summary(arguments, path, frames):
    folder = Path(arguments.scratch) / "run"
    shutil.rmtree(folder, ignore_errors=True)
    command = [arguments.charcloth, "run", path, "--frames", str(frames), "--no-movie", "-q", "-o", str(folder)]
    run([*command, "--threads", str(arguments.threads)])
    return json.loads((folder / "summary.json").read_text())


def find(tree, key):
    """The first value of a key, at any depth."""
    if isinstance(tree, dict):
        if key in tree:
            return tree[key]
        tree = tree.values()
    found = [find(branch, key) for branch in tree if isinstance(branch, (dict, list))] if not isinstance(tree, str) else []
    return next((value for value in found if value is not None), None)


def charcloth(arguments, mesh, step, newton):
    path = scene(arguments, mesh, frames=arguments.frames, step=step, newton=newton)
    command = [arguments.charcloth, "bench", path, "--frames", str(arguments.frames), "--threads", str(arguments.threads)]
    out, processor = run(command)
    told = summary(arguments, path, arguments.frames)
    return {
        "clock": printed(out, "s_per_frame"),
        "processor": processor / arguments.frames,
        "p99_strain": printed(out, "strain_p99"),
        "crossing_pairs": find(told, "intersecting_pairs_max"),
        "passed_through": find(told, "passed_through"),
    }


BLENDER = """
import sys, time, json, numpy as np, bpy
source, quality, frames, tension, mass, distance, out = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), *map(float, sys.argv[4:7]), sys.argv[7]
file = np.load(source)
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_start, scene.frame_end = 1, frames + 1
mesh = bpy.data.meshes.new("sheet")
mesh.from_pydata(file["places"][:, [0, 2, 1]] * [1, -1, 1], [], file["triangles"].tolist())
sheet = bpy.data.objects.new("sheet", mesh)
scene.collection.objects.link(sheet)
bpy.ops.mesh.primitive_plane_add(size=4)
table = bpy.context.object
table.modifiers.new("collision", "COLLISION")
table.collision.thickness_outer = distance
table.collision.cloth_friction = 5
cloth = sheet.modifiers.new("cloth", "CLOTH")
settings = cloth.settings
settings.quality, settings.mass = quality, mass
settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = tension
settings.bending_stiffness = 0.01
settings.air_damping = 0.0
collision = cloth.collision_settings
collision.use_collision = collision.use_self_collision = True
collision.distance_min = collision.self_distance_min = distance
cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, frames + 1
scene.frame_set(1)
places, clock, processor = [], [], []
for frame in range(2, frames + 2):
    start = time.perf_counter(), time.process_time()
    scene.frame_set(frame)
    clock.append(time.perf_counter() - start[0])
    processor.append(time.process_time() - start[1])
    flat = np.empty(3 * len(mesh.vertices))
    sheet.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices.foreach_get("co", flat)
    places.append(flat.reshape(-1, 3)[:, [0, 2, 1]] * [1, 1, -1])
np.save(out, np.array(places))
print("RESULT " + json.dumps({"clock": float(np.mean(clock)), "processor": float(np.mean(processor))}))
"""


def blender(arguments, mesh, places, triangles, quality, tension):
    scratch = Path(arguments.scratch)
    np.savez(scratch / "sheet.npz", places=places, triangles=triangles)
    mass = GRAMMAGE * SIDE * SIDE / len(places)
    # Half the pitch, at most a millimetre: nearer than that its self-collision pushes neighbours apart.
    distance = min(1e-3, 0.5 * SIDE / arguments.segments)
    out = scratch / "blender.npy"
    settings = [quality, arguments.frames, tension, mass, distance]
    result = peer(arguments.blender, BLENDER, scratch / "sheet.npz", *settings, out)
    frames = np.load(out)
    edges = np.unique(np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]]), axis=1), axis=0)
    length = lambda p: np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=-1)
    crossing = []
    for frame in frames[:: max(1, len(frames) // 8)]:
        write_mesh(scratch / "frame.obj", frame, triangles)
        still = scene(arguments, scratch / "frame.obj", frames=1, moves="false", contact="")
        crossing.append(find(summary(arguments, still, 1), "intersecting_pairs"))
    strain = [np.quantile(np.abs(length(frame) / length(places) - 1), 0.99) for frame in frames]
    return {**result, "p99_strain": float(max(strain)), "crossing_pairs": max(crossing)}


def main():
    """Reads the arguments, measures, writes."""
    parser = command_line(__doc__)
    parser.add_argument("--segments", type=int, default=128)
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--scratch", default="/tmp/self_contact", help="folder for runs")
    arguments = parser.parse_args()
    Path(arguments.scratch).mkdir(parents=True, exist_ok=True)
    places, triangles = sheet(arguments.segments)
    mesh = Path(arguments.scratch) / "sheet.obj"
    write_mesh(mesh, places, triangles)
    rows = []

    def note(program, setting, figures):
        row = {"program": program, "segments": arguments.segments, "setting": setting, **figures}
        rows.append(rounded(row))
        print(rows[-1], flush=True)
        write(rows, arguments.csv)

    for step, newton in [(14, 5e-2), (14, 1e-2), (7, 1e-3)]:
        note("charcloth", f"{step} ms, {newton}", charcloth(arguments, mesh, step, newton))
    if arguments.blender:
        same = round(STIFFNESS * SIDE / arguments.segments, 3)
        for quality, tension in [(5, same), (20, same), (80, same)]:
            figures = blender(arguments, mesh, places, triangles, quality, tension)
            note("blender", f"quality {quality}, tension {tension}", figures)


if __name__ == "__main__":
    main()
