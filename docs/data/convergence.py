"""Does what burns depend on the mesh? A strip of newsprint lit at its foot, on three meshes, with ten seeds each.

    python docs/data/convergence.py charcloth runs docs/data/convergence.csv

Runs the command that is named, keeps the runs in the folder (and does not repeat those that are there), and writes a row
a run. Prints mean and standard deviation over the seeds by mesh. Needs numpy.
"""
import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy

COMMAND, RUNS, TABLE = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
SEEDS = range(1, 11)
SPACINGS = [6, 4, 2.67]  # of the mesh that moves [mm]; the one that burns is half as coarse
FRAMES, FPS = 36, 24
FLAKE = 1e-6  # least area of what counts as a flake [m2]

SCENE = """name = "strip"
about = "A strip of newsprint lit at its foot."
model = "physical"

[sheet]
material = "newsprint_45"
width = "30 mm"
height = "60 mm"
burn_level = 1

[shell]
newton_tolerance = 1e-2

[crack]
particle_area = 1e-6

[time]
step = "4 ms"
fps = 24

[[pin]]
edge = "top"

[[ignite]]
edge = "bottom"
length = "0.3 s"
"""


def run(spacing, seed):
    folder = RUNS / f"strip_{spacing}_{seed}"
    if not (folder / "summary.json").exists():
        scene = RUNS / "strip.toml"
        scene.write_text(SCENE)
        settings = [f"sheet.spacing={spacing} mm", f"seed={seed}"]
        sets = [part for setting in settings for part in ("--set", setting)]
        subprocess.run(
            [COMMAND, "run", scene, *sets, "--frames", str(FRAMES), "-o", folder, "--force", "--no-movie", "--quiet", "--threads", "1"],
            check=True,
        )
    return folder


def frame(folder, number):
    return numpy.load(folder / "cache" / f"frame_{number:05}.npz")


def measure(folder):
    last = frame(folder, FRAMES)
    lit = last["ignited_at"] >= 0
    height = frame(folder, 0)["position"][:, 1]
    places = last["rest_position"][:, 1] if "rest_position" in last else height
    middle = numpy.quantile(last["ignited_at"][lit], 0.5)
    front = {}
    for time in (0.5, 1.0, 1.5):
        there = lit & (last["ignited_at"] <= time)
        front[time] = (places[there].max() - height.min()) * 1e3 if there.any() else 0.0
    # Of the sheet that still hangs: area, how far its lowest part has turned out of the plane.
    row = {"half lit [s]": middle}
    for time, mm in front.items():
        row[f"front at {time} s [mm]"] = mm
    for time in (0.5, 1.0, 1.5):
        now = frame(folder, round(time * FPS))
        area = now["triangle_rest_area"] * (now["triangle_alive"] == 1)
        whole = now["triangle_piece"] == 0
        row[f"area that hangs at {time} s [mm2]"] = area[whole].sum() * 1e6
    now = frame(folder, FPS)
    hangs = (now["triangle_alive"] == 1) & (now["triangle_piece"] == 0)
    corners = now["triangle_corners"][hangs]
    a, b, c = (now["position"][corners[:, k]] for k in range(3))
    normal = numpy.cross(b - a, c - a)
    turn = numpy.degrees(numpy.arccos(numpy.clip(numpy.abs(normal[:, 2]) / numpy.maximum(numpy.linalg.norm(normal, axis=1), 1e-30), 0, 1)))
    weight = now["triangle_rest_area"][hangs]
    row["mean turn of what hangs at 1 s [deg]"] = float((turn * weight).sum() / max(weight.sum(), 1e-30))
    pieces = (last["piece_parent"] != 4294967295) & (last["piece_area"] > FLAKE)
    particles = last["particle_area"] > FLAKE
    row["flakes"] = int(pieces.sum() + particles.sum())
    row["mass of flakes [mg]"] = float(last["piece_mass"][pieces].sum() + last["particle_mass"][particles].sum()) * 1e6
    summary = json.loads((folder / "summary.json").read_text())
    row["error of mass"] = summary["mass_error"]
    return row


RUNS.mkdir(parents=True, exist_ok=True)
rows = []
for spacing in SPACINGS:
    for seed in SEEDS:
        rows.append({"spacing [mm]": spacing, "seed": seed, **measure(run(spacing, seed))})
with TABLE.open("w", newline="") as file:
    writer = csv.DictWriter(file, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: f"{value:.5g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows)
print("| quantity | " + " | ".join(f"{spacing} mm" for spacing in SPACINGS) + " |")
print("| --- |" + " --- |" * len(SPACINGS))
for key in list(rows[0])[2:]:
    cells = []
    for spacing in SPACINGS:
        values = numpy.array([row[key] for row in rows if row["spacing [mm]"] == spacing], float)
        cells.append(f"{values.mean():.3g} +- {values.std(ddof=1):.2g}")
    print(f"| {key} | " + " | ".join(cells) + " |")
