"""docs/pictures/validation.png from docs/data/validation.csv; needs matplotlib."""
import csv

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

rows = {}
with open("docs/data/validation.csv") as table:
    for row in csv.DictReader(line for line in table if not line.startswith("#")):
        if row["value"]:
            rows.setdefault(row["scene"], []).append((float(row["value"]), float(row["speed_mm_s"])))
figure, axes = plt.subplots(2, 3, figsize=(11, 6))
axes = axes.ravel()


def panel(axis, scene, label, factor=lambda x: 1, quantity="speed [mm/s]", logarithmic=""):
    burns = [(x, v * factor(x)) for x, v in rows[scene] if v == v]
    out = [x for x, v in rows[scene] if v != v]
    axis.plot(*zip(*burns), "o-", ms=3)
    if out:
        axis.plot(out, [0] * len(out), "x", color="black", clip_on=False, zorder=5)
    axis.set_xlabel(label)
    axis.set_ylabel(quantity)
    if "x" in logarithmic:
        axis.set_xscale("log")
    if "y" in logarithmic:
        axis.set_yscale("log")
    else:
        axis.set_ylim(bottom=0)


panel(axes[0], "spread_grammage", "grammage [g/m2], downward", lambda x: x / 1000, "speed x grammage [g/(m s)]")
axes[0].axhspan(0.19, 0.25, color="orange", alpha=0.3)
axes[0].plot([18.7, 37.4, 37.4, 75], [0.211, 0.225, 0.252, 0.19], "rs", ms=4)
panel(axes[1], "spread_oxygen", "mole fraction of oxygen, tissue")
panel(axes[2], "spread_pressure", "pressure [kPa], tissue")
panel(axes[3], "spread_gravity", "gravity over 9.81 m/s2, tissue", logarithmic="x")
panel(axes[4], "spread_direction", "angle of spread [deg], 80 g/m2", logarithmic="y")
panel(axes[5], "moisture", "moisture [%], 80 g/m2")
for axis in axes:
    axis.grid(alpha=0.3)
axes[1].plot([0.213], [11.3], "rs", ms=4)
figure.tight_layout()
figure.savefig("docs/pictures/validation.png", dpi=70)
