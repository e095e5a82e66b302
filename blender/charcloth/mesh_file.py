"""The sheet as a PLY file: the evaluated mesh in world space [m], with texture coordinates and painted weights."""

import random
from pathlib import Path

import bmesh
import bpy
import numpy as np
from mathutils import Matrix

# tuned: edges halve until they are below this part of the spacing, so lengths end about the spacing; 1.2 to 1.5 do.
LONGEST = 1.4
# tuned: part of an edge a point is moved at most, so that tears do not follow rows; from 0.35 triangles may turn over.
IRREGULARITY = 0.3
FLAT = 0.9999  # cosine of 0.8 degrees


def write_sheet(sheet: bpy.types.Object, path: Path, metres: float, weights: dict[str, str], spacing: float) -> int:
    """Writes an object as it is evaluated now, and says how many points it has.

    `metres` is the length of a unit of the scene [m], `weights` names a vertex group or attribute for each layer that
    is wanted, `spacing` is the distance of points [m]; 0 leaves the faces as they are.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = sheet.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    work = bmesh.new()
    try:
        values = {layer: point_values(sheet, mesh, name) for layer, name in weights.items()}
        work.from_mesh(mesh)
        for layer, numbers in values.items():
            column = work.verts.layers.float.new(f"charcloth_{layer}")
            for point, number in zip(work.verts, numbers, strict=True):
                point[column] = float(number)
        work.transform(Matrix.Scale(metres, 4) @ evaluated.matrix_world)
        if spacing > 0:
            refine(work, spacing)
        bmesh.ops.triangulate(work, faces=work.faces[:], quad_method="BEAUTY")
        _write_ply(work, path, list(weights))
        return len(work.verts)
    finally:
        work.free()
        evaluated.to_mesh_clear()


def point_values(sheet: bpy.types.Object, mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    """A number for each point: weight in a vertex group, or an attribute; the luminance of a colour."""
    group = sheet.vertex_groups.get(name)
    if group is not None:
        return np.array([_weight(point, group.index) for point in mesh.vertices])
    attribute = mesh.attributes.get(name)
    if attribute is None:
        raise ValueError(f'"{sheet.name}" has no vertex group or attribute "{name}"')
    width, field = {
        "FLOAT": (1, "value"),
        "BOOLEAN": (1, "value"),
        "INT": (1, "value"),
        "FLOAT_COLOR": (4, "color"),
        "BYTE_COLOR": (4, "color"),
    }.get(attribute.data_type, (0, ""))
    if not width or attribute.domain not in {"POINT", "CORNER"}:
        raise ValueError(f'attribute "{name}" is neither numbers nor colours of points')
    values = np.zeros(len(attribute.data) * width, dtype=bool if attribute.data_type == "BOOLEAN" else np.float32)
    if attribute.data_type == "INT":
        values = values.astype(np.int32)
    attribute.data.foreach_get(field, values)
    values = values.reshape(-1, width).astype(float)
    values = values @ (0.2126, 0.7152, 0.0722, 0.0) if width == 4 else values[:, 0]  # Rec. 709
    return values if attribute.domain == "POINT" else _mean_of_corners(mesh, values)


def _weight(point: bpy.types.MeshVertex, group: int) -> float:
    return next((entry.weight for entry in point.groups if entry.group == group), 0.0)


def _mean_of_corners(mesh: bpy.types.Mesh, values: np.ndarray) -> np.ndarray:
    corners = np.zeros(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    count = np.bincount(corners, minlength=len(mesh.vertices))
    return np.bincount(corners, values, len(mesh.vertices)) / np.maximum(count, 1)


def refine(work: bmesh.types.BMesh, spacing: float) -> None:
    """Halves edges until none is much longer than the spacing [m], then moves points about where the sheet is flat."""
    for _ in range(16):
        long = [edge for edge in work.edges if edge.calc_length() > LONGEST * spacing]
        if not long:
            break
        bmesh.ops.subdivide_edges(work, edges=long, cuts=1, use_grid_fill=True)
        bad = [face for face in work.faces if len(face.verts) > 4]
        if bad:
            bmesh.ops.triangulate(work, faces=bad)
    bmesh.ops.triangulate(work, faces=work.faces[:], quad_method="ALTERNATE")
    work.verts.index_update()
    work.edges.index_update()
    work.normal_update()
    _shake(work, [point for point in work.verts if _is_free(point, work.loops.layers.uv.active)])


def _is_free(point: bmesh.types.BMVert, uv: bmesh.types.BMLayerItem | None) -> bool:
    """Whether a point can slide and the sheet look the same: flat around it, no border and no seam."""
    faces = point.link_faces
    if point.is_boundary or not point.is_manifold:
        return False
    if uv is not None and len({tuple(round(x, 5) for x in corner[uv].uv) for corner in point.link_loops}) > 1:
        return False
    return all(faces[0].normal.dot(face.normal) > FLAT for face in faces)


def _shake(work: bmesh.types.BMesh, points: list[bmesh.types.BMVert]) -> None:
    """Slides points along an edge, texture coordinates with them; the same every time."""
    chance = random.Random(1)
    uv = work.loops.layers.uv.active
    for point in points:
        edge = chance.choice(sorted(point.link_edges, key=lambda edge: edge.index))
        part = IRREGULARITY * chance.random()
        if uv is not None:
            corner = next(corner for corner in edge.link_loops)
            ends = (corner, corner.link_loop_next)
            here, there = ends if corner.vert is point else ends[::-1]
            slide = (there[uv].uv - here[uv].uv) * part
            for corner in point.link_loops:
                corner[uv].uv += slide
        point.co += (edge.other_vert(point).co - point.co) * part


def _write_ply(work: bmesh.types.BMesh, path: Path, layers: list[str]) -> None:
    work.verts.index_update()
    uv = work.loops.layers.uv.active
    columns = [work.verts.layers.float[f"charcloth_{layer}"] for layer in layers]
    points = [[*point.co, *(point[column] for column in columns)] for point in work.verts]
    names = ["x", "y", "z", *layers]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(work.faces)}", "property list uchar int vertex_indices"]
    face_type = [("count", "u1"), ("corners", "<i4", 3)]
    if uv is not None:
        header.append("property list uchar float texcoord")
        face_type += [("uv_count", "u1"), ("uv", "<f4", 6)]
    faces = np.zeros(len(work.faces), dtype=face_type)
    faces["count"] = 3
    faces["corners"] = [[corner.vert.index for corner in face.loops] for face in work.faces]
    if uv is not None:
        faces["uv_count"] = 6
        faces["uv"] = [[x for corner in face.loops for x in corner[uv].uv] for face in work.faces]
    text = "\n".join([*header, "end_header", ""]).encode()
    path.write_bytes(text + np.array(points, dtype="<f4").reshape(-1, len(names)).tobytes() + faces.tobytes())
