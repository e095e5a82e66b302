"""Does what burns depend on the mesh? A strip of newsprint lit at its foot, on three meshes, with ten seeds each.

    python docs/data/convergence.py charcloth runs docs/data/convergence.csv docs/pictures/convergence.png

Runs the command that is named, keeps the runs in the folder (and does not repeat those that are there), and writes a row
a run. Prints mean and standard deviation over the seeds by mesh, and draws them against time. Needs numpy and matplotlib.
"""
import csv
import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy

matplotlib.use("Agg")
import matplotlib.pyplot as plt

COMMAND, RUNS, TABLE, PICTURE = sys.argv[1], *(Path(part) for part in sys.argv[2:5])
SEEDS = range(1, 11)
SPACINGS = [6, 4, 2.67]  # of the mesh that moves [mm]; the one that burns is half as coarse
FRAMES, FPS = 36, 24
NONE = 4294967295  # no parent: the sheet itself
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
step = "14 ms"
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


def curl_radius(frame, hangs):
    """Of the hem that has charred by half and more: area over the sum of how far it turns along each side [m]."""
    corners, place = frame["triangle_corners"], frame["position"]
    black = hangs & (frame["charred"][corners].mean(1) > 0.5)
    hem, area = corners[black], frame["triangle_rest_area"][black].sum()
    a, b, c = (place[hem[:, k]] for k in range(3))
    normal = numpy.cross(b - a, c - a)
    normal /= numpy.maximum(numpy.linalg.norm(normal, axis=1), 1e-30)[:, None]
    sides = numpy.sort(numpy.concatenate([hem[:, [0, 1]], hem[:, [1, 2]], hem[:, [2, 0]]]), axis=1)
    owner = numpy.tile(numpy.arange(len(hem)), 3)
    order = numpy.lexsort((sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    shared = numpy.flatnonzero((sides[1:] == sides[:-1]).all(1))
    turn = numpy.arccos(numpy.clip((normal[owner[shared]] * normal[owner[shared + 1]]).sum(1), -1, 1))
    rest = frame["rest_position"]
    length = numpy.linalg.norm(rest[sides[shared, 0]] - rest[sides[shared, 1]], axis=1)
    turned = (turn * length).sum()
    return area / turned if turned > 0 else numpy.nan


def measure(folder):
    """A row of the table, and what goes into the picture: front, area that hangs and number of flakes at each frame."""
    last, first = frame(folder, FRAMES), frame(folder, 0)
    lit = last["ignited_at"] >= 0
    height = last["rest_position"][:, 1] - first["rest_position"][:, 1].min()
    course = []
    for number in range(FRAMES + 1):
        now = frame(folder, number)
        there = lit & (last["ignited_at"] <= number / FPS)
        hangs = (now["triangle_alive"] == 1) & (now["triangle_piece"] == 0)
        pieces = (now["piece_parent"] != NONE) & (now["piece_area"] > FLAKE)
        particles = now["particle_area"] > FLAKE
        course.append(
            [
                height[there].max() * 1e3 if there.any() else 0.0,
                now["triangle_rest_area"][hangs].sum() * 1e6,
                curl_radius(now, hangs) * 1e3,
                pieces.sum() + particles.sum(),
                (now["piece_mass"][pieces].sum() + now["particle_mass"][particles].sum()) * 1e6,
            ]
        )
    row = {"half lit [s]": numpy.quantile(last["ignited_at"][lit], 0.5)}
    for time in (0.5, 1.0, 1.5):
        row[f"front at {time} s [mm]"] = course[round(time * FPS)][0]
    for time in (0.5, 1.0, 1.5):
        row[f"area that hangs at {time} s [mm2]"] = course[round(time * FPS)][1]
    row["curl radius of the hem at 1 s [mm]"] = course[FPS][2]
    row["flakes"], row["mass of flakes [mg]"] = course[FRAMES][3:]
    summary = json.loads((folder / "summary.json").read_text())
    row["error of mass"], row["error of energy"] = summary["mass_error"], summary["energy_error"]
    row["wall [s]"] = summary["wall_s"]
    return row, course


def draw(courses):
    """Means over the seeds against time, with a band of one standard deviation to each side."""
    figure, axes = plt.subplots(1, 4, figsize=(14, 3.2), layout="constrained")
    names = ["front [mm]", "area that hangs [mm2]", "flakes over 1 mm2", "their mass [mg]"]
    time = numpy.arange(FRAMES + 1) / FPS
    for spacing in SPACINGS:
        of_mesh = numpy.array(courses[spacing], float)
        for axis, column in zip(axes, (0, 1, 3, 4)):
            mean, scatter = of_mesh[:, :, column].mean(0), of_mesh[:, :, column].std(0, ddof=1)
            (line,) = axis.plot(time, mean, label=f"{spacing} mm")
            axis.fill_between(time, mean - scatter, mean + scatter, color=line.get_color(), alpha=0.15, linewidth=0)
    for axis, name in zip(axes, names):
        axis.set_title(name)
        axis.set_xlabel("time [s]")
        axis.set_ylim(bottom=0)
    axes[0].legend(title="motion mesh")
    figure.savefig(PICTURE, dpi=75)


RUNS.mkdir(parents=True, exist_ok=True)
rows, courses = [], {spacing: [] for spacing in SPACINGS}
for spacing in SPACINGS:
    for seed in SEEDS:
        row, course = measure(run(spacing, seed))
        rows.append({"spacing [mm]": spacing, "seed": seed, **row})
        courses[spacing].append(course)
draw(courses)
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
