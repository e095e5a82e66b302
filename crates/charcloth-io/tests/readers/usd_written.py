"""OpenUSD writes a mesh in every way that it has, and the same as OBJ in metres, y up.

Argument: folder to write into.
"""

import sys
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdUtils, Vt

folder = Path(sys.argv[1])
SIDE = 30


def build(path, sampled):
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    top = UsdGeom.Xform.Define(stage, "/world")
    stage.SetDefaultPrim(top.GetPrim())
    top.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    top.AddRotateXYZOp().Set(Gf.Vec3f(20, 30, 40))
    top.AddScaleOp().Set(Gf.Vec3f(1, 2, 1.5))
    mesh = UsdGeom.Mesh.Define(stage, "/world/paper/sheet")
    below = UsdGeom.Xformable(mesh)
    below.AddTranslateOp(opSuffix="pivot").Set(Gf.Vec3d(0.5, 0, 0))
    below.AddOrientOp().Set(Gf.Quatf(0.9, 0.1, 0.3, 0.2).GetNormalized())
    below.AddTransformOp().Set(Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 1, 0), 25)) * Gf.Matrix4d().SetTranslate((3, 1, 2)))
    below.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
    i, j = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    points = np.stack([i, j, np.sin(i * 0.3) + 0.1 * j], 2).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(SIDE - 1)[None] + SIDE * np.arange(SIDE - 1)[:, None]).ravel()
    quads = np.stack([corner, corner + 1, corner + SIDE + 1, corner + SIDE], 1)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([4] * len(quads)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(quads.ravel().astype(np.int32)))
    values = Vt.Vec3fArray.FromNumpy(points)
    attribute = mesh.CreatePointsAttr()
    if sampled:
        attribute.Set(Vt.Vec3fArray.FromNumpy(points * 2), 30)
        attribute.Set(values, 12.5)
    else:
        attribute.Set(values)
    uv = (points[:, :2] / (SIDE - 1)).astype(np.float32)
    primvars = UsdGeom.PrimvarsAPI(mesh)
    st = primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    st.Set(Vt.Vec2fArray.FromNumpy(uv))
    st.SetIndices(Vt.IntArray.FromNumpy(quads.ravel().astype(np.int32)))
    n = np.arange(len(points))
    # A crate packs these in three ways: as whole numbers, by a table, and not at all.
    for name, painted in [("whole", n), ("few", np.array([0.5, 0.25, 1e-3])[n % 3]), ("many", 1 / (n + np.float32(3)))]:
        primvar = primvars.CreatePrimvar(name, Sdf.ValueTypeNames.FloatArray, "vertex")
        primvar.Set(Vt.FloatArray.FromNumpy(painted.astype(np.float32)))
    stage.GetRootLayer().Save()
    place = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(mesh.GetPrim()))
    world = 0.01 * (np.c_[points, np.ones(len(points))] @ place)[:, :3]
    return np.stack([world[:, 0], world[:, 2], -world[:, 1]], 1), uv, quads


for name, sampled in [("text.usda", 0), ("crate.usdc", 0), ("samples.usdc", 1)]:
    world, uv, quads = build(folder / name, sampled)
Sdf.Layer.FindOrOpen(str(folder / "crate.usdc")).Export(str(folder / "crate.usd"), args={"format": "usdc"})
Sdf.Layer.FindOrOpen(str(folder / "text.usda")).Export(str(folder / "text.usd"), args={"format": "usda"})
assert UsdUtils.CreateNewUsdzPackage(str(folder / "crate.usdc"), str(folder / "package.usdz"))
with open(folder / "expected.obj", "w") as out:
    out.writelines("v %.9f %.9f %.9f\n" % tuple(p) for p in world)
    out.writelines("vt %.9g %.9g\n" % tuple(t) for t in uv)
    out.writelines("f " + " ".join(f"{k + 1}/{k + 1}" for k in quad) + "\n" for quad in quads)
print("SOUND")
