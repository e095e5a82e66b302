"""OpenVDB, as Blender has it, reads grids: every voxel to the bit, and no others.

Argument: folder with `grids.vdb`, what must be in it (place, bits of both values), and `empty.vdb`.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

bpy.utils.expose_bundled_modules()
import openvdb  # noqa: E402

folder = Path(sys.argv[1])
expected = {}
for line in (folder / "expected.txt").read_text().splitlines():
    x, y, z, *bits = map(int, line.split())
    expected[x, y, z] = np.array(bits, np.uint32).view(np.float32)
grids, _ = openvdb.readAll(str(folder / "grids.vdb"))
assert [grid.name for grid in grids] == ["flame", "temperature"]
for column, grid in enumerate(grids):
    assert grid.gridClass == "fog volume" and grid.background == 0
    assert np.allclose(grid.transform.voxelSize(), 0.0017, rtol=1e-12)
    assert np.allclose(grid.transform.indexToWorld((1, -2, 3)), (0.0017, -0.0034, 0.0051), rtol=1e-12)
    assert grid.activeVoxelCount() == len(expected)
    reader = grid.getConstAccessor()
    for place, values in expected.items():
        value, there = reader.probeValue(place)
        assert there and np.float32(value) == values[column], (place, value, values)
(empty,), _ = openvdb.readAll(str(folder / "empty.vdb"))
assert empty.activeVoxelCount() == 0 and empty.name == "flame"
print("SOUND", len(expected), "voxels")
