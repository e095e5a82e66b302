"""Width and roughness of fronts: docs/pictures/roughness.png from run folders of scenes/validation/roughness.toml.

    charcloth run scenes/validation/roughness.toml --case fast -o fast
    python docs/data/roughness.py fast slow

Needs numpy, scipy and matplotlib. The front at a time t is the lowest place lit before t, column by column.
"""
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy
from scipy.interpolate import LinearNDInterpolator

COLUMN = 0.35e-3  # between columns: the distance of burn nodes [m]
SKIP = 0.03  # from either side, where the frame is felt [m]


def arrival(folder):
    """Moment at which each place was lit [s], by row from the top and column."""
    frames = sorted((Path(folder) / "cache").glob("frame_*.npz"))
    frame = numpy.load(frames[-1])
    place, lit = frame["position"], frame["ignited_at"]
    known = lit >= 0
    x = numpy.arange(place[:, 0].min() + SKIP, place[:, 0].max() - SKIP, COLUMN)
    y = numpy.arange(place[:, 1].max(), place[known, 1].min(), -COLUMN)
    return x, y, LinearNDInterpolator(place[known, :2], lit[known])(*numpy.meshgrid(x, y))


def fronts(y, lit):
    """Times [s] and heights of the front [m] there, row by column; places are lit from the top down."""
    latest = numpy.fmax.accumulate(lit, axis=0)
    times = numpy.linspace(numpy.nanmax(latest[8]), numpy.nanmin(latest[-8]), 60)
    rows = [numpy.array([numpy.searchsorted(column[~numpy.isnan(column)], t) for column in latest.T]) for t in times]
    return times, y[0] - COLUMN * numpy.array(rows)


def slope(x, y):
    good = (x > 0) & (y > 0)
    return numpy.polyfit(numpy.log(x[good]), numpy.log(y[good]), 1)[0]


figure, (over_time, over_length) = plt.subplots(1, 2, figsize=(10, 4))
for folder in sys.argv[1:]:
    x, y, lit = arrival(folder)
    times, height = fronts(y, lit)
    height = height - height.mean(axis=1, keepdims=True)
    since, width = times - times[0], height.std(axis=1)
    windows = numpy.unique(numpy.geomspace(4, len(x) // 4, 24).astype(int))
    late = height[len(height) // 2 :]

    def roughness(window):
        parts = late[:, : len(x) // window * window].reshape(len(late), -1, window)
        return parts.std(axis=2).mean()

    rough = numpy.array([roughness(window) for window in windows])
    lengths = windows * COLUMN
    short, growing = lengths < 4e-3, (since > 0.05 * since[-1]) & (since < 0.5 * since[-1])
    in_time, in_length = slope(since[growing], width[growing]), slope(lengths[short], rough[short])
    print(f"{folder}: {len(x)} columns, width {width[0] * 1e3:.2f} to {width[-1] * 1e3:.2f} mm,"
          f" slope in time {in_time:.2f}, in length under 4 mm {in_length:.2f}, over 4 mm {slope(lengths[~short], rough[~short]):.2f}")
    over_time.loglog(since[1:], 1e3 * width[1:], ".-", label=f"{Path(folder).name}: slope {in_time:.2f}")
    over_length.loglog(1e3 * lengths, 1e3 * rough, ".-", label=f"{Path(folder).name}: slope {in_length:.2f} under 4 mm")
over_time.set(xlabel="time since the first straight front [s]", ylabel="width of the front [mm]")
over_length.set(xlabel="length of the window [mm]", ylabel="roughness in it [mm]")
for axis in (over_time, over_length):
    axis.legend()
    axis.grid(alpha=0.3, which="both")
figure.tight_layout()
figure.savefig("docs/pictures/roughness.png", dpi=80)
