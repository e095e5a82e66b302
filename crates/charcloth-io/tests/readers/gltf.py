"""trimesh reads every frame of a .glb, and what it reads is what the cache has.

Arguments: folder of the run, .glb file.
"""

import glob
import sys

import numpy as np
import trimesh

run, path = sys.argv[1:]
scene = trimesh.load_scene(path, process=False)
frames = sorted(glob.glob(f"{run}/cache/frame_*.npz"))
assert len(scene.geometry) == len(frames), (len(scene.geometry), len(frames))
for file in frames:
    frame = np.load(file)
    mesh = scene.geometry[f"frame_{int(frame['number']):05}"]
    alive = frame["triangle_alive"] == 1
    corners = frame["triangle_corners"][alive]
    assert len(mesh.faces) == len(corners)
    assert np.array_equal(mesh.vertices[mesh.faces], frame["position"][corners])
    uv = frame["triangle_uv"][alive]
    assert np.allclose(mesh.visual.uv[mesh.faces], uv, atol=1e-6)
    temperature = mesh.vertex_attributes["_TEMPERATURE"].reshape(-1)
    assert np.array_equal(temperature[mesh.faces], frame["temperature"][corners])
print("SOUND", len(frames))
