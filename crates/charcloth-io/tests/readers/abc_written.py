"""Alembic's own library writes a mesh in several ways, and the same as OBJ.

Argument: folder to write into.
"""

import sys
from pathlib import Path

import imath
import numpy as np
from alembic3d import Abc, AbcGeom

folder = Path(sys.argv[1])
SIDE = 20
KINDS = AbcGeom.XformOperationType
V = imath.V3d

i, j = (index.ravel() for index in np.meshgrid(np.arange(SIDE), np.arange(SIDE)))
points = np.stack([i + 0.3 * j, j, np.sin(i * 0.3) + 0.1 * j], 1).astype(np.float32) / 64
corner = (np.arange(SIDE - 1)[None] + SIDE * np.arange(SIDE - 1)[:, None]).ravel()
quads = np.stack([corner, corner + 1, corner + SIDE + 1, corner + SIDE], 1)
uv = (np.stack([i, j], 1) / (SIDE - 1)).astype(np.float32)
# Seen from outside they run clockwise in Alembic.
in_file = quads[:, ::-1]


def ints(values, array=imath.IntArray):
    out = array(len(values))
    for k, value in enumerate(values):
        out[k] = int(value)
    return out


def vectors(values, array, vector):
    out = array(len(values))
    for k, value in enumerate(values):
        out[k] = vector(*(float(v) for v in value))
    return out


def floats(values):
    out = imath.FloatArray(len(values))
    for k, value in enumerate(values):
        out[k] = float(value)
    return out


def placed(parent, name, operations, inherits=True):
    """A transform below another, and its matrix (of rows)."""
    sample = AbcGeom.XformSample()
    sample.setInheritsXforms(inherits)
    for kind, *arguments in operations:
        sample.addOp(AbcGeom.XformOp(kind), *arguments)
    transform = AbcGeom.OXform(parent, name)
    transform.getSchema().set(sample)
    matrix = sample.getMatrix()
    return transform, np.array([[matrix[a][b] for b in range(4)] for a in range(4)])


def mesh(parent, name, scope, at=points, later=None, kind="PolyMesh"):
    """A mesh with texture coordinates by point or by corner and two painted attributes."""
    thing = getattr(AbcGeom, f"O{kind}")(parent, name)
    schema = thing.getSchema()
    by_corner = scope == AbcGeom.GeometryScope.kFacevaryingScope
    if by_corner:
        indices = ints(in_file.ravel(), imath.UnsignedIntArray)
        texture = AbcGeom.OV2fGeomParamSample(vectors(uv, imath.V2fArray, imath.V2f), indices, scope)
    else:
        texture = AbcGeom.OV2fGeomParamSample(vectors(uv, imath.V2fArray, imath.V2f), scope)
    for k, places in enumerate([at] if later is None else [at, later]):
        sample = getattr(AbcGeom, f"O{kind}SchemaSample")(
            vectors(places, imath.V3fArray, imath.V3f), ints(in_file.ravel()), ints([4] * len(quads))
        )
        sample.setUVs(texture)
        schema.set(sample)
    vertex = AbcGeom.GeometryScope.kVertexScope
    parameters = schema.getArbGeomParams()
    pin = AbcGeom.OFloatGeomParam(parameters, "pin", False, vertex, 1)
    pin.set(AbcGeom.OFloatGeomParamSample(floats(np.arange(len(points)) / 64), vertex))
    colors = AbcGeom.OC3fGeomParam(parameters, "Cd", False, vertex, 1)
    column = imath.C3fArray(len(points))
    for k in range(len(points)):
        column[k] = imath.Color3f(k / 1024, 0.5, 0.25)
    colors.set(AbcGeom.OC3fGeomParamSample(column, vertex))
    return thing


def expect(name, matrix, faces):
    world = (np.c_[points, np.ones(len(points))] @ matrix)[:, :3]
    with open(folder / f"{name}.obj", "w") as out:
        out.writelines("v %.9f %.9f %.9f\n" % tuple(p) for p in world)
        out.writelines("vt %.9g %.9g\n" % tuple(t) for t in uv)
        out.writelines("f " + " ".join(f"{k + 1}/{k + 1}" for k in quad) + "\n" for quad in faces)


corners, vertices = AbcGeom.GeometryScope.kFacevaryingScope, AbcGeom.GeometryScope.kVertexScope
turned = imath.M44d()
turned.rotate(V(0.3, 0.2, 0.1))
above = [
    (KINDS.kTranslateOperation, V(0.1, 0.2, 0.3)),
    (KINDS.kRotateOperation, V(1, 2, 0.5), 25.0),
    (KINDS.kScaleOperation, V(1, 2, 1.5)),
]
below = [
    (KINDS.kRotateXOperation, 20.0),
    (KINDS.kRotateYOperation, 30.0),
    (KINDS.kRotateZOperation, 40.0),
    (KINDS.kMatrixOperation, turned),
]


def archive(name, inherits=True, mirrored=False):
    """An archive with two transforms, and where they put what is below."""
    top = Abc.OArchive(str(folder / f"{name}.abc")).getTop()
    outer, outer_matrix = placed(top, "world", above)
    mirror = [(KINDS.kScaleOperation, V(-1, 1, 1))] if mirrored else []
    inner, matrix = placed(outer, "paper", below + mirror, inherits)
    return inner, matrix @ outer_matrix if inherits else matrix


inner, matrix = archive("corners")
mesh(inner, "sheet", corners, later=points * 2)
expect("corners", matrix, quads)

inner, matrix = archive("alone", inherits=False)
mesh(inner, "cage", vertices, kind="SubD")
hidden = mesh(inner, "hidden", corners)
AbcGeom.CreateVisibilityProperty(hidden, 0).setValue(0)
expect("alone", matrix, quads)

inner, matrix = archive("mirrored", mirrored=True)
mesh(inner, "sheet", vertices)
expect("mirrored", matrix, in_file)

inner, _ = archive("two")
mesh(inner, "left", corners)
mesh(inner, "right", corners)
print("SOUND")
