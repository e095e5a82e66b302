"""The scene `corner` on 128 x 181 cells, burning at level 2, beside the cloth of Blender alone at that size with self-collision.

    python3 corner.py --charcloth target/release/charcloth --blender PYTHON_WITH_BPY --csv corner.csv

Charcloth burns, cracks and moves; Blender's sheet of the same weight hangs by its upper corners and does nothing else. Seconds
a frame by the clock and of the processor, and for Charcloth by stage. Needs a Python that has bpy 5.0.1.
"""

import re

from work_precision import command_line, peer, printed, rounded, run, write

BLENDER = """
import sys, time, json, bpy
columns, rows, quality, frames = map(int, sys.argv[1:5])
width, height = 0.210, 0.297
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_start, scene.frame_end = 1, frames + 1
places = [(width * i / columns, 0.0, -height * j / rows) for j in range(rows + 1) for i in range(columns + 1)]
n = columns + 1
faces = [(j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i) for j in range(rows) for i in range(columns)]
mesh = bpy.data.meshes.new("sheet")
mesh.from_pydata(places, [], faces)
sheet = bpy.data.objects.new("sheet", mesh)
scene.collection.objects.link(sheet)
sheet.vertex_groups.new(name="pin").add([0, columns], 1.0, "REPLACE")
cloth = sheet.modifiers.new("cloth", "CLOTH")
settings = cloth.settings
settings.vertex_group_mass = "pin"
settings.quality = quality
settings.mass = 80e-3 * width * height / len(places)
cloth.collision_settings.use_collision = False
cloth.collision_settings.use_self_collision = True
cloth.collision_settings.self_distance_min = 1e-3
cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, frames + 1
scene.frame_set(1)
start = time.perf_counter(), time.process_time()
for frame in range(2, frames + 2):
    scene.frame_set(frame)
clock, processor = time.perf_counter() - start[0], time.process_time() - start[1]
print("RESULT " + json.dumps({"clock": clock / frames, "processor": processor / frames}))
"""


def main():
    """Reads the arguments, measures, writes."""
    parser = command_line(__doc__, threads=2)
    parser.add_argument("--columns", type=int, default=128)
    parser.add_argument("--rows", type=int, default=181)
    parser.add_argument("--frames", type=int, nargs="+", default=[240], help="of Charcloth, one run each")
    parser.add_argument("--blender-frames", type=int, default=24)
    arguments = parser.parse_args()
    rows = []

    def note(row):
        rows.append(rounded(row))
        print(rows[-1], flush=True)
        write(rows, arguments.csv)

    for frames in arguments.frames:
        spacing = f"sheet.spacing={210 / arguments.columns} mm"
        command = [arguments.charcloth, "bench", "corner", "--set", spacing, "--frames", str(frames)]
        out, processor = run([*command, "--threads", str(arguments.threads)])
        stages = {name: float(seconds) / frames for name, seconds in re.findall(r"^  (\w+) +([\d.]+) s", out, re.M)}
        told = {"nodes": int(re.search(r"(\d+) nodes", out)[1]), "clock": printed(out, "s_per_frame")}
        told["processor"] = processor / frames
        note({"program": "charcloth", "setting": f"{frames} frames", **told, **stages})
    for quality in [5, 10] if arguments.blender else []:
        result = peer(arguments.blender, BLENDER, arguments.columns, arguments.rows, quality, arguments.blender_frames)
        nodes = (arguments.columns + 1) * (arguments.rows + 1)
        note({"program": "blender", "setting": f"quality {quality}", "nodes": nodes, **result})


if __name__ == "__main__":
    main()
