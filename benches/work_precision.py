"""Error against time of implicit motion: the scene `hang` at several step lengths, beside Blender's cloth and XPBD; and
other scenes (`--scene`), with errors over the whole sheet, Charcloth alone.

    python3 work_precision.py --charcloth target/release/charcloth [--blender PYTHON_WITH_BPY] [--pypbd PYTHON_WITH_PYPBD] \\
        --segments 32 64 --csv work_precision.csv --picture work_precision.svg

Errors are those of the two free corners against a run of Charcloth with steps of 0.5 ms (1 ms from 64 segments on) on the same mesh,
while the sheet falls (12 frames; later it crumples, and no two runs agree): root of the mean square over corners and frames, and the largest. Strain is that of the edges along both axes in the worst frame, column
stretch the largest change of the arc length of a column. Time is that of a frame, of the processor and of the clock.
Other scenes are compared at every node, with a run of a fourteenth of the scene's longest step.

Needs numpy and matplotlib; Blender's cloth needs a Python that has bpy 5.0.1, XPBD one that has pypbd 2.2.2.
"""

import argparse
import csv
import json
import os
import resource
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np

SIDE = 0.21
COLUMNS = ["program", "segments", "setting", "clock", "processor", "newton", "linear", "corner_rms_mm", "corner_max_mm"]
COLUMNS += ["sheet_rms_mm", "p99_strain", "max_strain", "column_stretch"]


def run(command, **options):
    """What a command prints, and its processor time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=True, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def printed(out, key):
    """A figure that `charcloth bench` prints."""
    return float(out.split(f"{key}=")[1].split()[0])


def peer(python, script, *settings, **options):
    """What the script of a peer says of itself."""
    out, _ = run([python, "-c", script, *settings], **options)
    return json.loads(out.split("RESULT ")[1].splitlines()[0])


def command_line(text, threads=1):
    """What all of these programs are told."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--charcloth", required=True, help="the program")
    parser.add_argument("--blender", help="a Python that has bpy")
    parser.add_argument("--threads", type=int, default=threads)
    parser.add_argument("--csv", required=True)
    return parser


def read_pc2(path):
    """Points of all frames, (frames, points, 3)."""
    data = Path(path).read_bytes()
    points, _, _, frames = struct.unpack_from("<iffi", data, 16)
    return np.frombuffer(data, "<f4", offset=32).reshape(frames, points, 3).astype(float)


def in_grid(paths):
    """Frames as (frames, rows, columns, 3); rows are from the pinned side on, places from its first corner."""
    rest = paths[0]
    flat = rest[:, [0, 2]] if np.ptp(rest[:, 1]) < 1e-6 else rest[:, [0, 1]]
    side = round(len(rest) ** 0.5)
    order = np.lexsort((flat[:, 0].round(6), flat[:, 1].round(6)))
    grid = paths[:, order].reshape(len(paths), side, side, 3)
    moved = np.linalg.norm(grid[-1] - grid[0], axis=-1)
    grid = grid if moved[0, 0] < moved[-1, 0] else grid[:, ::-1]
    return grid - grid[0, 0, 0]


def strains(grid):
    """Strain of the edges along both axes, frame by frame."""
    pitch = SIDE / (grid.shape[1] - 1)
    along = np.linalg.norm(np.diff(grid, axis=1), axis=-1)
    across = np.linalg.norm(np.diff(grid, axis=2), axis=-1)
    return [np.abs(np.concatenate([a.ravel(), b.ravel()]) / pitch - 1) for a, b in zip(along, across)]


def figures(grid, reference):
    """What is compared."""
    corners = [(-1, 0), (-1, -1)]
    way = np.stack([grid[:, r, c] for r, c in corners], 1)
    true = np.stack([reference[:, r, c] for r, c in corners], 1)
    off = np.linalg.norm(way - true, axis=-1)
    all_off = np.linalg.norm(grid - reference, axis=-1)
    strain = strains(grid)
    columns = np.linalg.norm(np.diff(grid, axis=1), axis=-1).sum(1) / SIDE - 1
    return {
        "corner_rms_mm": 1e3 * float(np.sqrt((off**2).mean())),
        "corner_max_mm": 1e3 * float(off.max()),
        "sheet_rms_mm": 1e3 * float(np.sqrt((all_off**2).mean())),
        "p99_strain": max(float(np.quantile(s, 0.99)) for s in strain[1:]),
        "max_strain": max(float(s.max()) for s in strain[1:]),
        "column_stretch": float(np.abs(columns[1:]).max()),
    }


def run_charcloth(arguments, segments, frames, settings, folder):
    """Points of a run by frame, and its seconds a frame: clock, processor."""
    sets = [f"--set={key}={value}" for key, value in {**size(arguments.scene, segments), **settings}.items()]
    command = [arguments.charcloth, "bench", arguments.scene, "--frames", str(frames), "--threads", str(arguments.threads)]
    out, processor = run([*command, *sets])
    words = next(line for line in out.splitlines() if "Newton" in line).split()
    result = {"clock": printed(out, "s_per_frame"), "processor": processor / frames}
    result |= {"newton": float(words[0]), "linear": float(words[5]), "p99_strain": printed(out, "strain_p99")}
    shutil.rmtree(folder, ignore_errors=True)
    run([arguments.charcloth, "run", arguments.scene, "--frames", frames, "--no-movie", "-q", "-o", folder, *sets])
    run([arguments.charcloth, "export", "--format", "pc2", "-o", f"{folder}/pc2", folder])
    points = read_pc2(next(Path(folder, "pc2").glob("*.pc2")))
    shutil.rmtree(folder, ignore_errors=True)
    return in_grid(points) if arguments.scene == "hang" else points, result


def size(scene, segments):
    """Keys that give a sheet so many segments a side."""
    if scene.endswith("fold"):
        return {"sheet.spacing": f"{240 / segments} mm"}
    if scene.endswith("crumple.toml"):
        return {"sheet.spacing": f"{120 / segments} mm"}
    if scene.endswith("drape"):
        return {"sheet.spacing": f"{300 / segments} mm"}
    return {"sheet.segments": segments}


def compare_steps(arguments):
    """Rows of figures of a scene that is not `hang`: one for each size and length of step."""
    rows = []
    for segments in arguments.segments:
        folder = f"{arguments.scratch}/{Path(arguments.scene).stem}_{segments}"
        settings = {"time.step": "1 ms", "shell.newton_tolerance": 1e-4, "shell.linear_tolerance": 1e-2}
        reference, timed = run_charcloth(arguments, segments, arguments.frames, settings, folder)
        runs = [("1 ms, 0.0001", reference, timed)]
        for step, newton in [(3.5, 1e-3), (7, 1e-3), (14, 1e-3), (14, 1e-2), (42, 1e-2)]:
            settings = {"time.step": f"{step} ms", "shell.newton_tolerance": newton}
            runs.append((f"{step} ms, {newton}", *run_charcloth(arguments, segments, arguments.frames, settings, folder)))
        for setting, points, timed in runs:
            off = np.linalg.norm(points - reference, axis=-1)
            errors = {"sheet_rms_mm": 1e3 * float(np.sqrt((off**2).mean())), "sheet_max_mm": 1e3 * float(off.max())}
            row = {"scene": Path(arguments.scene).stem, "segments": segments, "setting": setting, **timed, **errors}
            rows.append(rounded(row))
            print(rows[-1], flush=True)
        write(rows, arguments.csv)
    return rows


BLENDER = """
import sys, time, json, numpy as np, bpy
n, quality, frames, tension, out = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]), sys.argv[5]
side = 0.21
h = side / (n - 1)
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_start, scene.frame_end = 1, frames + 1
vertices = [(i * h, -j * h, 0.0) for j in range(n) for i in range(n)]
faces = [(j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i) for j in range(n - 1) for i in range(n - 1)]
mesh = bpy.data.meshes.new("sheet")
mesh.from_pydata(vertices, [], faces)
sheet = bpy.data.objects.new("sheet", mesh)
scene.collection.objects.link(sheet)
sheet.vertex_groups.new(name="pin").add([0, n - 1], 1.0, "REPLACE")
cloth = sheet.modifiers.new("cloth", "CLOTH")
settings = cloth.settings
settings.vertex_group_mass = "pin"
settings.quality = quality
settings.mass = 80e-3 * side * side / (n * n)
settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = tension
settings.air_damping = 0.0
settings.tension_damping = settings.compression_damping = settings.shear_damping = settings.bending_damping = 0.0
settings.bending_stiffness = 0.0
cloth.collision_settings.use_collision = False
cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, frames + 1
scene.frame_set(1)
places, clock, processor = [np.array(vertices)], [], []
for frame in range(2, frames + 2):
    start = time.perf_counter(), time.process_time()
    scene.frame_set(frame)
    clock.append(time.perf_counter() - start[0])
    processor.append(time.process_time() - start[1])
    evaluated = sheet.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    flat = np.empty(3 * n * n)
    evaluated.vertices.foreach_get("co", flat)
    places.append(flat.reshape(-1, 3))
np.save(out, np.array(places)[..., [0, 2, 1]] * [1, 1, -1])
print("RESULT " + json.dumps({"clock": float(np.mean(clock)), "processor": float(np.mean(processor))}))
"""


def run_blender(arguments, segments, frames, quality, tension, folder):
    """The same of Blender's cloth: the weight of our sheet, no air, no damping, no resistance to bending."""
    out = f"{folder}.npy"
    result = peer(arguments.blender, BLENDER, segments + 1, quality, frames, tension, out)
    grid = in_grid(np.load(out))
    Path(out).unlink()
    return grid, result


PYPBD = """
import sys, time, json, numpy as np, pypbd
n, substeps, frames, out = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
side = 0.21
simulation = pypbd.Simulation.getCurrent()
simulation.initDefault()
model = simulation.getModel()
level = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
model.addRegularTriangleModel(n, n, [0, 0, 0], level, [side, side])
triangles, particles = model.getTriangleModels()[0], model.getParticles()
for i in range(n * n):
    particles.setMass(i, 80e-3 * side * side / (n * n))
for i in (0, n - 1):
    particles.setMass(i, 0.0)
# XPBD: springs of 2 kN/m a width, and the bending of a plate of 0.1 mm with that modulus.
model.addClothConstraints(triangles, 4, 2e3, 1.0, 1.0, 1.0, 0.3, 0.3, False, False)
model.addBendingConstraints(triangles, 3, 1.8e-6)
model.initConstraintGroups()
stepper = simulation.getTimeStep()
stepper.setValueUInt(pypbd.TimeStepController.NUM_SUB_STEPS, substeps)
stepper.setValueUInt(pypbd.TimeStepController.MAX_ITERATIONS, 1)
pypbd.TimeManager.getCurrent().setTimeStepSize(1.0 / 24.0)
places, clock, processor = [np.array(particles.getVertices()).copy()], [], []
for frame in range(frames):
    start = time.perf_counter(), time.process_time()
    stepper.step(model)
    clock.append(time.perf_counter() - start[0])
    processor.append(time.process_time() - start[1])
    places.append(np.array(particles.getVertices()).copy())
np.save(out, np.array(places))
print("RESULT " + json.dumps({"clock": float(np.mean(clock)), "processor": float(np.mean(processor))}))
"""


def run_pypbd(arguments, segments, frames, substeps, folder):
    """The same of XPBD by the library PositionBasedDynamics, one iteration a substep."""
    out = f"{folder}.npy"
    environment = {**os.environ, "OMP_NUM_THREADS": str(arguments.threads)}
    result = peer(arguments.pypbd, PYPBD, segments + 1, substeps, frames, out, env=environment)
    grid = in_grid(np.load(out))
    Path(out).unlink()
    return grid, result


def rounded(row):
    """A row with four digits of each number."""
    return {key: float(f"{value:.4g}") if isinstance(value, float) else value for key, value in row.items()}


def write(rows, path):
    """The table so far: runs are long."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), restval="")
        writer.writeheader()
        writer.writerows(rows)


def collect(arguments):
    """Rows of figures, one a run."""
    rows = []

    def note(program, segments, setting, timed, compared):
        row = {"program": program, "segments": segments, "setting": setting, **timed, **compared}
        row = {key: row[key] for key in COLUMNS if key in row}
        rows.append(rounded(row))
        print(rows[-1], flush=True)
        write(rows, arguments.csv)

    for segments in arguments.segments:
        folder = f"{arguments.scratch}/{segments}"
        finest = 0.5 if segments < 64 else 1
        fine = {"time.step": f"{finest} ms", "shell.newton_tolerance": 1e-4, "shell.linear_tolerance": 1e-2}
        kept = Path(f"{folder}_reference.npz")
        if kept.exists():
            with np.load(kept) as file:
                reference, timed = file["grid"], json.loads(str(file["timed"]))
        else:
            reference, timed = run_charcloth(arguments, segments, arguments.frames, fine, folder)
            np.savez(kept, grid=reference, timed=json.dumps(timed))
        note("charcloth", segments, f"{finest} ms, 0.0001", timed, figures(reference, reference))
        small = [(1, 1e-4), (2, 1e-3), (3.5, 1e-3)] if segments < 64 else []
        for step, newton in [*small, (7, 1e-3), (14, 1e-3), (14, 1e-2), (21, 1e-2), (42, 1e-2)]:
            settings = {"time.step": f"{step} ms", "shell.newton_tolerance": newton}
            grid, timed = run_charcloth(arguments, segments, arguments.frames, settings, folder)
            note("charcloth", segments, f"{step} ms, {newton}", timed, figures(grid, reference))
        # The tension of Blender's springs that is the same material; 1000, as stiff as it goes; and far softer ones.
        same = round(2e3 * SIDE / segments, 2)
        for quality, tension in [(5, 1000), (20, 1000), (5, same), (20, same), (20, 0.1), (80, 0.1)]:
            if arguments.blender:
                grid, timed = run_blender(arguments, segments, arguments.frames, quality, tension, folder)
                name = f"quality {quality}, tension {tension}"
                note("blender", segments, name, timed, figures(grid, reference))
        for substeps in [10, 60, 200]:
            if arguments.pypbd:
                grid, timed = run_pypbd(arguments, segments, arguments.frames, substeps, folder)
                note("pypbd", segments, f"{substeps} substeps", timed, figures(grid, reference))
    return rows


def draw(rows, picture):
    """Error of the corners and strain against the time of the processor."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plot
    from matplotlib import ticker

    sizes = sorted({row["segments"] for row in rows})
    figure, axes = plot.subplots(2, len(sizes), figsize=(5.2 * len(sizes), 7.6), squeeze=False, sharey="row")
    colours = {"charcloth": "#b5482a", "blender": "#37598c", "pypbd": "#5b8c37"}
    measures = [("corner_rms_mm", "error of the free corners [mm, rms]"), ("p99_strain", "strain, 99th percentile [1]")]
    for axis_row, (measure, label) in zip(axes, measures):
        for axis, segments in zip(axis_row, sizes):
            for program, colour in colours.items():
                shown = [r for r in rows if (r["program"], r["segments"]) == (program, segments) and r["corner_rms_mm"]]
                times, values = [r["processor"] for r in shown], [r[measure] for r in shown]
                axis.plot(times, values, "o", color=colour, label=program)
                for r in shown:
                    short = r["setting"].replace("quality ", "q").replace("tension ", "T")
                    at = r["processor"], r[measure]
                    axis.annotate(short, at, fontsize=7, xytext=(4, 4), textcoords="offset points")
            axis.set(xscale="log", yscale="log", title=f"{segments} segments a side")
            axis.margins(x=0.15)
            axis.xaxis.set_minor_formatter(ticker.NullFormatter())
            axis.grid(True, which="both", alpha=0.25)
        axis_row[0].set_ylabel(label)
    for axis in axes[-1]:
        axis.set_xlabel("processor time a frame [s]")
    axes[0][0].legend()
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


def main():
    """Reads the arguments, measures, writes."""
    parser = command_line(__doc__)
    parser.add_argument("--pypbd", help="a Python that has pypbd")
    parser.add_argument("--segments", type=int, nargs="+", default=[32, 64], help="cells a side")
    parser.add_argument("--scene", default="hang", help="hang, drape, fold, benches/clamp.toml or benches/crumple.toml")
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--scratch", default="/tmp/work_precision", help="folder for runs, which are removed again but for references")
    parser.add_argument("--picture", help="of `hang` only")
    parser.add_argument("--draw-only", action="store_true", help="draw the table that is there")
    arguments = parser.parse_args()
    if arguments.draw_only:
        with open(arguments.csv, newline="", encoding="utf-8") as file:
            texts = {"program", "setting"}
            read = csv.DictReader(file)
            rows = [{k: v if k in texts else float(v or 0) for k, v in row.items()} for row in read]
            rows = [{**row, "segments": int(row["segments"])} for row in rows]
    else:
        Path(arguments.scratch).mkdir(parents=True, exist_ok=True)
        rows = collect(arguments) if arguments.scene == "hang" else compare_steps(arguments)
    if arguments.picture and arguments.scene == "hang":
        draw(rows, arguments.picture)


if __name__ == "__main__":
    main()
