"""The scene `corner` on 128 x 181 cells, burning at level 2, beside the cloth of Blender alone at that size with self-collision.

    python3 corner.py --charcloth target/release/charcloth --blender PYTHON_WITH_BPY --csv corner.csv

Charcloth burns, cracks and moves; Blender's sheet of the same weight hangs by its upper corners and does nothing else. Seconds
a frame by the clock and of the processor, and for Charcloth by stage. Needs a Python that has bpy 5.0.1.
"""

import argparse
import json
import re
import subprocess

from self_contact import run
from work_precision import rounded, write

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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--charcloth", required=True, help="the program")
    parser.add_argument("--blender", help="a Python that has bpy")
    parser.add_argument("--columns", type=int, default=128)
    parser.add_argument("--rows", type=int, default=181)
    parser.add_argument("--frames", type=int, nargs="+", default=[240], help="of Charcloth, one run each")
    parser.add_argument("--blender-frames", type=int, default=24)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--csv", required=True)
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
        clock = float(out.split("s_per_frame=")[1].split()[0])
        told = {"nodes": int(re.search(r"(\d+) nodes", out)[1]), "clock": clock, "processor": processor / frames}
        note({"program": "charcloth", "setting": f"{frames} frames", **told, **stages})
    for quality in [5, 10] if arguments.blender else []:
        command = [arguments.blender, "-c", BLENDER, arguments.columns, arguments.rows, quality, arguments.blender_frames]
        done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=True)
        result = json.loads(done.stdout.split("RESULT ")[1].splitlines()[0])
        note({"program": "blender", "setting": f"quality {quality}", "nodes": (arguments.columns + 1) * (arguments.rows + 1), **result})


if __name__ == "__main__":
    main()
