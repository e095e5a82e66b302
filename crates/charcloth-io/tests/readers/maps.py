"""OpenEXR and Pillow read the maps, and they show what the cache has at the centre of every texel looked at.

Arguments: folder of the run, folder of the maps.
"""

import glob
import json
import sys

import numpy as np
import OpenEXR
import PIL.Image

run, folder = sys.argv[1:]
about = json.load(open(f"{folder}/maps.json"))
side = about["resolution"]
frames = [np.load(file) for file in sorted(glob.glob(f"{run}/cache/frame_*.npz"))]
assert about["frames"] == [int(frame["number"]) for frame in frames]

# The texel in the middle of each triangle, and how much of each corner it shows.
uv = frames[0]["triangle_uv"].astype(np.float64)
texel = np.floor(uv.mean(1) * side).astype(int)
a, b, c = uv[:, 0], uv[:, 1], uv[:, 2]
place = (texel + 0.5) / side


def cross(p, q):
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]


area = cross(b - a, c - a)
weights = np.stack([cross(b - place, c - place), cross(c - place, a - place), cross(a - place, b - place)], 1)
weights /= area[:, None]
inside = weights.min(1) > 1e-3
assert inside.sum() > 100
column, row = texel[inside, 0], side - 1 - texel[inside, 1]
weights = weights[inside]


def image(name, channel):
    channels = OpenEXR.File(f"{folder}/{name}").channels()
    if "RGB" in channels:
        return channels["RGB"].pixels[..., "RGB".index(channel)]
    return channels[channel].pixels


for frame in frames:
    name = f"burn_{int(frame['number']):05}"
    corners = frame["triangle_corners"][inside]
    temperature = (weights * frame["temperature"][corners]).sum(1)
    alive = frame["triangle_alive"][inside]
    pixels = image(f"{name}.exr", "R")
    assert pixels.dtype == np.float32 and pixels.shape == (side, side)
    assert np.allclose(pixels[row, column], temperature, rtol=1e-5)
    assert np.array_equal(image(f"{name}.exr", "B")[row, column], alive)
    char = image(f"{name}.exr", "G")
    assert 0 <= char.min() and char.max() <= 1
    picture = np.asarray(PIL.Image.open(f"{folder}/{name}.png"))
    assert np.abs(picture[..., 0] - np.minimum(pixels, 1500) / 1500 * 255).max() < 0.51
    assert np.abs(picture[..., 1] - char * 255).max() < 0.51
    # Paper fills its texture and the gutter the rest, so no texel is left out.
    assert pixels.min() > 200
assert char.max() > 0.9 and not alive.all()

last = frames[-1]
arrival = image("arrival.exr", "Y")
times = last["ignited_at"][last["triangle_corners"][inside]]
lit = times.min(1) >= 0
assert lit.sum() > 10 and np.allclose(arrival[row, column][lit], (weights * times).sum(1)[lit], atol=1e-5)
assert (arrival[row, column][times.max(1) < 0] == -1).all()
grey = np.asarray(PIL.Image.open(f"{folder}/arrival.png")).astype(np.float64)
assert (grey[arrival < 0] == 65535).all()
assert np.abs(grey[arrival >= 0] / 65534 * last["time"] - arrival[arrival >= 0]).max() < 1e-4
print("SOUND", inside.sum(), "texels a frame")
