"""Mean velocities in a .usdc are those from the frame before to the frame after.

Arguments: folder of the run, .usdc file.
"""

import sys

import numpy as np
from pxr import Usd, UsdGeom

run, path = sys.argv[1:]
stage = Usd.Stage.Open(path)
mesh = UsdGeom.Mesh(stage.GetDefaultPrim().GetChild("sheet"))
times = mesh.GetPointsAttr().GetTimeSamples()
frames = [np.load(f"{run}/cache/frame_{int(time):05}.npz") for time in times]
ids = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("id")
for k, time in enumerate(times):
    before, after = frames[max(k - 1, 0)], frames[min(k + 1, len(frames) - 1)]
    nodes = np.array(ids.Get(time))
    there = nodes < len(before["position"])
    nodes = nodes[there]
    mean = (after["position"][nodes] - before["position"][nodes]) / (after["time"] - before["time"])
    assert np.allclose(np.array(mesh.GetVelocitiesAttr().Get(time))[there], mean, atol=1e-4), time
prim = stage.GetDefaultPrim().GetChild("particles")
for k, time in enumerate(times if prim else []):
    before, after = frames[max(k - 1, 0)], frames[min(k + 1, len(frames) - 1)]
    count = len(before["particle_mass"])
    mean = (after["particle_position"][:count] - before["particle_position"]) / (after["time"] - before["time"])
    assert np.allclose(np.array(UsdGeom.Points(prim).GetVelocitiesAttr().Get(time))[:count].reshape(-1, 3), mean, atol=1e-4), time
print("SOUND")
