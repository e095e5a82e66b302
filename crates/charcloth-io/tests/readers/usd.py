"""OpenUSD reads what was written: its own validators find nothing, and every frame is that of the cache.

Arguments: folder of the run, .usdc or .usdz file.
"""

import sys

import numpy as np
from pxr import Usd, UsdGeom, UsdShade, UsdValidation

run, path = sys.argv[1:]
stage = Usd.Stage.Open(path)
validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
assert len(validators) >= 30, len(validators)
found = UsdValidation.ValidationContext(validators).Validate(stage)
assert not found, [(error.GetName(), error.GetMessage()) for error in found]

assert UsdGeom.GetStageMetersPerUnit(stage) == 1 and UsdGeom.GetStageUpAxis(stage) == "Z"
assert stage.GetTimeCodesPerSecond() == 24 and stage.GetFramesPerSecond() == 24
prim = stage.GetDefaultPrim().GetChild("sheet")
mesh = UsdGeom.Mesh(prim)
assert mesh.GetSubdivisionSchemeAttr().Get() == "none" and mesh.GetDoubleSidedAttr().Get()
material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
shader, _, _ = material.ComputeSurfaceSource()
assert shader.GetIdAttr().Get() == "UsdPreviewSurface"
color = shader.GetInput("diffuseColor").GetConnectedSources()[0][0].source
assert UsdShade.Shader(color).GetInput("varname").Get() == "displayColor"

primvars = UsdGeom.PrimvarsAPI(mesh)
times = mesh.GetPointsAttr().GetTimeSamples()
assert times[0] == stage.GetStartTimeCode() and times[-1] == stage.GetEndTimeCode()
faces_seen = set()
start = np.load(f"{run}/cache/frame_00000.npz")
# Rows of the built-in sheet by their number in the input; with a fine burn mesh corners of triangles come first.
corner = np.isclose(start["origin_weights"].max(1), 1)
rest_of_input = np.zeros((start["source"].max() + 1, 3), np.float32)
rest_of_input[start["source"][corner]] = start["rest_position"][corner]
for time in times:
    frame = np.load(f"{run}/cache/frame_{int(time):05}.npz")
    alive = frame["triangle_alive"] == 1
    corners = frame["triangle_corners"][alive]
    nodes = np.unique(corners)

    def primvar(name, interpolation):
        values = primvars.GetPrimvar(name)
        assert values.GetInterpolation() == interpolation, name
        return np.array(values.ComputeFlattened(time))

    points = np.array(mesh.GetPointsAttr().Get(time)).reshape(-1, 3)
    counts = mesh.GetFaceVertexCountsAttr().Get(time)
    indices = mesh.GetFaceVertexIndicesAttr().Get(time)
    sound, why = UsdGeom.Mesh.ValidateTopology(indices, counts, len(points))
    assert sound, why
    assert set(counts) == {3}
    # Single precision throughout, so what is read is what the cache has to the bit.
    assert np.array_equal(primvar("id", "vertex"), nodes)
    assert np.array_equal(points, frame["position"][nodes])
    assert np.array_equal(np.array(mesh.GetVelocitiesAttr().Get(time)), frame["velocity"][nodes])
    assert np.array_equal(nodes[np.array(indices)].reshape(-1, 3), corners)
    assert np.array_equal(primvar("st", "faceVarying").reshape(-1, 3, 2), frame["triangle_uv"][alive])
    assert np.array_equal(primvar("temperature", "vertex"), frame["temperature"][nodes])
    assert np.array_equal(primvar("rest", "vertex"), frame["rest_position"][nodes])
    assert np.array_equal(primvar("source", "vertex"), frame["source"][nodes])
    # Where on the input each point comes from; at rest that is where it lies.
    weights = primvar("origin_weights", "vertex")
    assert np.array_equal(weights, frame["origin_weights"][nodes])
    assert np.array_equal(primvar("origin_face", "vertex"), frame["origin_face"][nodes])
    points_of_input = np.stack([primvar(f"origin_{corner}", "vertex") for corner in "abc"], 1)
    assert np.array_equal(points_of_input, frame["origin_points"][nodes])
    there = (weights[:, :, None] * rest_of_input[points_of_input]).sum(1)
    assert np.allclose(there, frame["rest_position"][nodes], atol=1e-7)
    for name in ("piece", "source_face", "sheet"):
        assert np.array_equal(primvar(name, "uniform"), frame[f"triangle_{name}"][alive]), name
    # What is known of a piece stands once a piece; flattened it stands at each of its faces.
    pieces = frame["triangle_piece"][alive]
    for name in ("parent", "birth", "mass", "area", "temperature"):
        values = frame[f"piece_{name}"].astype(np.int32 if name == "parent" else np.float32)
        assert np.array_equal(primvar(f"piece_{name}", "uniform"), values[pieces]), name
        assert len(primvars.GetPrimvar(f"piece_{name}").Get(time)) == len(values)
    left = frame["fuel"][nodes] / frame["fuel_initial"][nodes]
    assert np.allclose(primvar("fuel", "vertex"), left, atol=1e-6)
    assert np.allclose(primvar("burn", "vertex"), 1 - left, atol=1e-6)
    lit = frame["ignited_at"][nodes]
    assert np.allclose(primvar("age", "vertex"), np.where(lit < 0, -1, frame["time"] - lit), atol=1e-6)
    for name in ("char", "ash", "displayColor", "alive"):
        values = primvar(name, "vertex")
        assert len(values) == len(nodes) and values.min() >= 0 and values.max() <= 1, name
    assert len(mesh.GetNormalsAttr().Get(time)) == len(nodes)
    low, high = mesh.GetExtentAttr().Get(time)
    assert np.array_equal(points.min(0), low) and np.array_equal(points.max(0), high)
    faces_seen.add(len(counts))
assert len(faces_seen) > 2, "the sheet does not tear"

# Particles are points, in all frames if in one.
shed = [np.load(f"{run}/cache/frame_{int(time):05}.npz") for time in times]
prim = stage.GetDefaultPrim().GetChild("particles")
assert bool(prim) == any(len(frame["particle_mass"]) for frame in shed)
for time, frame in zip(times, shed if prim else []):
    points = UsdGeom.Points(prim)
    places = np.array(points.GetPointsAttr().Get(time)).reshape(-1, 3)
    count = len(frame["particle_mass"])
    assert np.array_equal(places, frame["particle_position"])
    assert np.array_equal(np.array(points.GetVelocitiesAttr().Get(time)).reshape(-1, 3), frame["particle_velocity"])
    assert np.array_equal(points.GetIdsAttr().Get(time), np.arange(count))
    widths = np.array(points.GetWidthsAttr().Get(time))
    assert points.GetWidthsInterpolation() == "vertex"
    assert np.allclose(np.pi / 4 * widths**2, frame["particle_area"], rtol=1e-5)
    primvars = UsdGeom.PrimvarsAPI(points)
    for name in ("parent", "birth", "mass", "area", "temperature", "lies"):
        values = primvars.GetPrimvar(name)
        assert values.GetInterpolation() == "vertex"
        assert np.array_equal(values.Get(time), frame[f"particle_{name}"]), name
    assert np.allclose(primvars.GetPrimvar("age").Get(time), frame["time"] - frame["particle_birth"], atol=1e-6)
    assert np.array_equal(primvars.GetPrimvar("id").Get(time), np.arange(count))
    assert len(primvars.GetPrimvar("displayColor").Get(time)) == count
    low, high = points.GetExtentAttr().Get(time)
    if count:
        half = widths[:, None] / 2
        assert np.allclose(low, (places - half).min(0), atol=1e-6) and np.allclose(high, (places + half).max(0), atol=1e-6)
# The default is the topology of no frame: whoever asks without a time must get nothing rather than half of it.
assert mesh.GetPointsAttr().Get() is None
print("SOUND", len(times), "frames", faces_seen)
