"""Alembic's own library reads what was written, and every frame is that of the cache.

Arguments: folder of the run, .abc file. The scene is z-up, Alembic y-up.
"""

import sys
from pathlib import Path

import numpy as np
from alembic3d import Abc, AbcGeom

run, path = sys.argv[1:]
archive = Abc.IArchive(path)
top = archive.getTop()
shed = any(len(np.load(frame)["particle_mass"]) for frame in Path(f"{run}/cache").glob("frame_*.npz"))
assert [top.getChild(k).getName() for k in range(top.getNumChildren())] == ["sheet", "particles"][: 1 + shed]
mesh = AbcGeom.IPolyMesh(top.getChild(0), Abc.WrapExistingFlag.kWrapExisting)
schema = mesh.getSchema()
assert schema.getTopologyVariance() == AbcGeom.MeshTopologyVariance.kHeterogenousTopology
count = schema.getNumSamples()
sampling = schema.getTimeSampling()
parameters = schema.getArbGeomParams()
names = {parameters.getPropertyHeader(k).getName() for k in range(parameters.getNumProperties())}


def at(k):
    # A bare number would be a time.
    return Abc.ISampleSelector(sampling.getSampleTime(k))


def turned(vectors):
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], 1)


def vectors(values):
    return np.array([[v[0], v[1], v[2]] for v in values], np.float32).reshape(-1, 3)


def parameter(name, k):
    array = Abc.IInt32ArrayProperty if name in whole else Abc.IFloatArrayProperty
    return np.array(list(array(parameters, name).getValue(at(k))))


origins = {"origin_face", "origin_a", "origin_b", "origin_c"}
weights = {f"origin_weights_{corner}" for corner in "abc"}
whole = {"id", "source", "alive", "piece", "source_face", "sheet"} | origins
pieces = {f"piece_{name}" for name in ("parent", "birth", "mass", "area", "temperature")}
assert names == whole | {"temperature", "fuel", "burn", "char", "ash", "age", "Cd", "rest"} | weights | pieces, names
for k in range(count):
    frame = np.load(f"{run}/cache/frame_{k:05}.npz")
    assert abs(sampling.getSampleTime(k) - frame["time"]) < 1e-9
    sample = schema.getValue(at(k))
    alive = frame["triangle_alive"] == 1
    corners = frame["triangle_corners"][alive]
    nodes = np.unique(corners)
    assert np.array_equal(vectors(sample.getPositions()), turned(frame["position"][nodes]))
    assert np.array_equal(vectors(sample.getVelocities()), turned(frame["velocity"][nodes]))
    indices = np.array(list(sample.getFaceIndices())).reshape(-1, 3)
    assert set(sample.getFaceCounts()) == {3} and len(sample.getFaceCounts()) == len(corners)
    # Clockwise there, anticlockwise here.
    assert np.array_equal(nodes[indices], corners[:, ::-1])
    uv = schema.getUVsParam().getExpandedValue(at(k)).getVals()
    uv = np.array([[v[0], v[1]] for v in uv], np.float32).reshape(-1, 3, 2)
    assert np.array_equal(uv, frame["triangle_uv"][alive][:, ::-1])
    normals = vectors(schema.getNormalsParam().getExpandedValue(at(k)).getVals())
    assert len(normals) == len(nodes) and np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    low, high = sample.getSelfBounds().min(), sample.getSelfBounds().max()
    assert np.array_equal(turned(frame["position"][nodes]).min(0), np.float32([low[0], low[1], low[2]]))
    assert np.array_equal(turned(frame["position"][nodes]).max(0), np.float32([high[0], high[1], high[2]]))
    assert np.array_equal(parameter("id", k), nodes)
    assert np.array_equal(parameter("temperature", k).astype(np.float32), frame["temperature"][nodes])
    assert np.array_equal(parameter("origin_face", k), frame["origin_face"][nodes])
    for column, name in enumerate(("origin_a", "origin_b", "origin_c")):
        assert np.array_equal(parameter(name, k), frame["origin_points"][nodes, column])
        weights = parameter(f"origin_weights_{name[-1]}", k).astype(np.float32)
        assert np.array_equal(weights, frame["origin_weights"][nodes, column])
    assert np.array_equal(parameter("piece", k), frame["triangle_piece"][alive])
    for name in sorted(pieces):
        compound = Abc.ICompoundProperty(parameters, name)
        array = Abc.IInt32ArrayProperty if name == "piece_parent" else Abc.IFloatArrayProperty
        values = np.array(list(array(compound, ".vals").getValue(at(k))))
        indices = np.array(list(Abc.IUInt32ArrayProperty(compound, ".indices").getValue(at(k))))
        expected = frame[name].astype(np.int32) if name == "piece_parent" else frame[name]
        assert np.array_equal(values.astype(expected.dtype), expected) and np.array_equal(indices, frame["triangle_piece"][alive]), name

if shed:
    points = AbcGeom.IPoints(top.getChild(1), Abc.WrapExistingFlag.kWrapExisting)
    schema = points.getSchema()
    parameters = schema.getArbGeomParams()
    whole = {"parent", "lies"}
    assert schema.getNumSamples() == count
    for k in range(count):
        frame = np.load(f"{run}/cache/frame_{k:05}.npz")
        sample = schema.getValue(at(k))
        number = len(frame["particle_mass"])
        assert np.array_equal(vectors(sample.getPositions()), turned(frame["particle_position"]))
        assert np.array_equal(vectors(sample.getVelocities()), turned(frame["particle_velocity"]))
        assert np.array_equal(np.array(list(sample.getIds()), int), np.arange(number))
        widths = np.array(list(schema.getWidthsParam().getExpandedValue(at(k)).getVals()))
        assert np.allclose(np.pi / 4 * widths**2, frame["particle_area"], rtol=1e-5)
        for name in ("parent", "birth", "mass", "area", "temperature", "lies"):
            assert np.array_equal(parameter(name, k).astype(np.float32), frame[f"particle_{name}"].astype(np.float32)), name
print("SOUND", count, "frames")
