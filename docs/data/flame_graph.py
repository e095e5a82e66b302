"""A flame graph of what `perf` saw: who calls whom, and how much of the time each takes.

    perf record -F 200 --call-graph dwarf,16384 -o perf.data target/release/charcloth bench hang --threads 1
    perf script -i perf.data -F ip,sym --inline > perf.txt
    python3 docs/data/flame_graph.py perf.txt docs/pictures/flame_graph.png

Only functions of the project are drawn, from the step of the integrator up; what they call elsewhere counts as theirs. Needs matplotlib.
"""

import re
import sys
from collections import defaultdict
from itertools import groupby

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

LEAST = 0.004  # least part of the time that is drawn
# What is drawn of functions that were inlined, whose names come without their modules.
INLINED = """advance stride solve find_correction correct solve_linear energy take_residual set_up join factorise coarsen pass_on
smooth_prolongation take_finest take_bodies largest_eigenvalue invert_diagonal place_aggregates assemble respond update lay_out cycle descend
smooth finish_residual restrict prolong multiply multiply_finest multiply_bodies finest_product product add_restricted detect safe_share step
weaken follow balance_momentum look_back store load sweep""".split()


def stacks(path):
    """Names of the functions of each sample, outermost first."""
    sample = []
    for line in open(path, errors="replace"):
        words = line.strip().split(None, 1)
        if words:
            sample.append((words[0], words[1] if len(words) > 1 else ""))
        elif sample:
            yield [name for _, group in groupby(sample[::-1], lambda frame: frame[0]) for name in names(list(group))]
            sample = []


def names(frames):
    """Names at one address: of the function, or of all that were inlined there, the outermost of which is the function."""
    inlined = [symbol.removesuffix(" (inlined)") for _, symbol in frames if symbol.endswith("(inlined)")]
    if inlined:
        bare = (re.sub(r"<.*", "", symbol) for symbol in inlined)
        return [name for name in bare if name in INLINED]
    symbol = frames[0][1]
    if "charcloth" not in symbol or "closure" in symbol:
        return []
    symbol = re.sub(r"<impl [^>]*>", "", re.sub(r"^<(\S+) as [^>]*>", r"\1", symbol))
    parts = [part for part in symbol.split("::") if part not in ("avx512", "avx2", "plain", "") and "{" not in part]
    return [re.sub(r"[<>].*", "", parts[-1])]


def main():
    """Reads samples, draws."""
    source, picture = sys.argv[1:3]
    tree = lambda: {"count": 0, "below": defaultdict(tree)}
    root = tree()
    for sample in stacks(source):
        if "advance_frame" not in sample:
            continue
        node = root
        node["count"] += 1
        last = None
        for name in sample[sample.index("advance_frame") + 1 :]:
            if name != last:
                node = node["below"][name]
                node["count"] += 1
            last = name
    figure, axes = plt.subplots(figsize=(13, 6.5))
    deepest = 0

    def draw(node, left, depth):
        nonlocal deepest
        for name, child in sorted(node["below"].items(), key=lambda item: -item[1]["count"]):
            width = child["count"] / root["count"]
            if width >= LEAST:
                shade = 0.55 + 0.4 * (hash_of(name) % 100) / 100
                axes.barh(depth, width, left=left, height=0.94, color=plt.cm.YlOrRd(0.85 - 0.6 * shade), edgecolor="white", lw=0.4)
                room = int(width * 175)
                label = f"{name} {100 * width:.0f} %"
                if len(label) > room:
                    label = name if len(name) <= room else ""
                axes.text(left + 0.5 * width, depth, label, ha="center", va="center", fontsize=7)
                deepest = max(deepest, depth)
                draw(child, left, depth + 1)
            left += width

    draw(root, 0.0, 0)
    axes.set(xlim=(0, 1), ylim=(-0.6, deepest + 0.6), yticks=[], xlabel=f"part of the time of a frame ({root['count']} samples)")
    for side in ("top", "left", "right"):
        axes.spines[side].set_visible(False)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


def hash_of(name):
    """A number that is the same on every run."""
    return sum(ord(letter) * (k + 7) for k, letter in enumerate(name))


if __name__ == "__main__":
    main()
