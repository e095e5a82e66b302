"""The fixed-topology twin, in a point cache or in textures, is where the cache says the sheet is.

Arguments: folder of the run, format, folder of the export.
"""

import glob
import json
import sys

import numpy as np

run, form, folder = sys.argv[1:]
frames = [np.load(file) for file in sorted(glob.glob(f"{run}/cache/frame_*.npz"))]
first = frames[0]["triangle_alive"] == 1

if form == "vat":
    import OpenEXR
    import PIL.Image
    import trimesh

    about = json.load(open(f"{folder}/vat.json"))
    assert about["frames"] == len(frames) and about["fps"] == 24 and about["up"] == "z"
    shape = about["height"], about["width"]
    channels = OpenEXR.File(f"{folder}/positions.exr").channels()
    image = channels["RGBA"].pixels if "RGBA" in channels else np.stack([channels[c].pixels for c in "RGBA"], -1)
    assert image.dtype == np.float32 and image.shape == (*shape, 4)
    normals = np.asarray(PIL.Image.open(f"{folder}/normals.png"))
    colors = np.asarray(PIL.Image.open(f"{folder}/colors.png"))
    assert normals.shape == (*shape, 3) and colors.shape == (*shape, 4)

    # As a shader would: from the second texture coordinates of the mesh to the texel of the frame. trimesh keeps the
    # first set only, so the numbers are taken from the file.
    data = open(f"{folder}/sheet.glb", "rb").read()
    length = int.from_bytes(data[12:16], "little")
    head, numbers = json.loads(data[20 : 20 + length]), data[28 + length :]

    def accessor(number, kind, columns):
        view = head["bufferViews"][head["accessors"][number]["bufferView"]]
        start = view["byteOffset"]
        return np.frombuffer(numbers[start : start + view["byteLength"]], kind).reshape(-1, columns)

    primitive = head["meshes"][0]["primitives"][0]
    texel = accessor(primitive["attributes"]["TEXCOORD_1"], "<f4", 2).astype(np.float64)
    uv = accessor(primitive["attributes"]["TEXCOORD_0"], "<f4", 2)
    faces = accessor(primitive["indices"], "<u4", 3)
    mesh = trimesh.load_mesh(f"{folder}/sheet.glb", process=False)
    assert np.array_equal(mesh.faces, faces)
    assert np.allclose(uv[faces] * [1, -1] + [0, 1], frames[0]["triangle_uv"][first], atol=1e-6)

    def points(k):
        down = texel[:, 1] + k * about["rows_per_frame"] / about["height"]
        column, row = np.floor(texel[:, 0] * shape[1]).astype(int), np.floor(down * shape[0]).astype(int)
        alive = image[row, column, 3]
        assert np.array_equal(alive * 255, colors[row, column, 3])
        length = np.linalg.norm(normals[row, column] / 127.5 - 1, axis=1)
        assert np.allclose(length, 1, atol=0.02)
        return image[row, column, :3], alive

elif form == "usd_twin":
    from pxr import Usd, UsdGeom, UsdValidation

    stage = Usd.Stage.Open(f"{folder}/twin.usdc")
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    assert not found, [(error.GetName(), error.GetMessage()) for error in found]
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim().GetChild("sheet"))
    primvars = UsdGeom.PrimvarsAPI(mesh)
    for attribute in (mesh.GetFaceVertexIndicesAttr(), mesh.GetFaceVertexCountsAttr()):
        assert not attribute.ValueMightBeTimeVarying(), "the faces change"
    faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    assert not primvars.GetPrimvar("st").ValueMightBeTimeVarying()
    uv = np.array(primvars.GetPrimvar("st").ComputeFlattened(0)).reshape(-1, 3, 2)
    assert np.array_equal(uv, frames[0]["triangle_uv"][first])

    def points(k):
        alive = np.array(primvars.GetPrimvar("alive").Get(k))
        moving = np.array(mesh.GetVelocitiesAttr().Get(k)).any(1)
        assert not (moving & (alive == 0)).any()
        temperature = np.array(primvars.GetPrimvar("temperature").Get(k))
        corners = frames[k]["triangle_corners"][first]
        assert np.array_equal(temperature[faces], frames[k]["temperature"][corners])
        return np.array(mesh.GetPointsAttr().Get(k)), alive

else:
    faces = np.array(
        [
            [int(corner.split("/")[0]) - 1 for corner in line.split()[1:]]
            for line in open(f"{folder}/sheet.obj")
            if line.startswith("f ")
        ]
    )
    count = sum(line.startswith("v ") for line in open(f"{folder}/sheet.obj"))
    data = open(f"{folder}/sheet.{form}", "rb").read()
    if form == "pc2":
        mark, version, head_count, start, rate, samples = (x.item() for x in np.frombuffer(
            data, "S12, <i4, <i4, <f4, <f4, <i4", 1)[0])
        assert (mark, version, start, rate) == (b"POINTCACHE2", 1, 0, 1)
        places = np.frombuffer(data[32:], "<f4")
    else:
        samples, head_count = np.frombuffer(data, ">i4", 2)
        times = np.frombuffer(data, ">f4", samples, 8)
        assert np.allclose(times, [frame["time"] for frame in frames], atol=1e-6)
        places = np.frombuffer(data, ">f4", -1, 8 + 4 * samples)
    assert (samples, head_count) == (len(frames), count)
    places = places.reshape(samples, count, 3)

    def points(k):
        return places[k], None


dead_seen, split_seen = 0, False
for k, frame in enumerate(frames):
    alive = frame["triangle_alive"][first] == 1
    where, living_points = points(k)
    corners = frame["triangle_corners"][first]
    assert np.array_equal(where[faces[alive]], frame["position"][corners[alive]])
    folded = where[faces[~alive]]
    assert (folded == folded[:, :1]).all(), "a dead triangle can be seen"
    if living_points is not None:
        # Exact by triangle: no point belongs to a living and to a dead one.
        assert (living_points[faces] == alive[:, None]).all()
    dead_seen = max(dead_seen, (~alive).sum())
    split_seen |= len(frame["position"]) > len(frames[0]["position"])
assert dead_seen and split_seen, "the sheet does not tear"
print("SOUND", len(frames), "frames,", faces.max() + 1, "points for", len(frames[0]["position"]), "nodes")
