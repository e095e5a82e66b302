"""What tests in Blender share: meshes as they are at a frame, and the frames of a cache to compare them with."""

from pathlib import Path

import bpy
import numpy as np

WIDTHS = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}


def evaluated(thing: bpy.types.Object, frame: int) -> bpy.types.Mesh:
    """The mesh of an object at a frame, behind its modifiers."""
    bpy.context.scene.frame_set(frame)
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def attribute(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    """Values of an attribute."""
    column = mesh.attributes[name]
    field, width = WIDTHS[column.data_type]
    values = np.zeros(len(column.data) * width, np.int32 if column.data_type == "INT" else np.float32)
    column.data.foreach_get(field, values)
    return values.reshape(-1, width) if width > 1 else values


def cache_frame(run: Path, number: int) -> tuple[dict, np.ndarray, np.ndarray]:
    """Arrays of a frame of the cache, living triangles, and the nodes that they use."""
    with np.load(run / "cache" / f"frame_{number:05}.npz") as file:
        frame = dict(file)
    corners = frame["triangle_corners"][frame["triangle_alive"] == 1]
    return frame, corners, np.unique(corners)


def check_frames(thing: bpy.types.Object, run: Path, start: int, last: int, reads: str) -> list[int]:
    """Compares every frame with the cache, and says how many faces each has.

    `reads` is "all" or "colors": attributes that the importer keeps. Frame 0 of the cache stands at frame `start`.
    """
    counts = []
    fps = bpy.context.scene.render.fps
    for number in range(last + 1):
        frame, corners, nodes = cache_frame(run, number)
        mesh = evaluated(thing, start + number)
        assert (len(mesh.vertices), len(mesh.polygons)) == (len(nodes), len(corners)), number
        assert np.allclose(attribute(mesh, "position"), frame["position"][nodes], atol=1e-6), number
        before, _, _ = cache_frame(run, max(number - 1, 0))
        after, _, _ = cache_frame(run, min(number + 1, last))
        there = nodes[nodes < len(before["position"])]
        seconds = (min(number + 1, last) - max(number - 1, 0)) / fps
        mean = (after["position"][there] - before["position"][there]) / seconds
        velocity = attribute(mesh, "velocity")[: len(there)]
        assert np.allclose(velocity, mean, atol=1e-4), (number, np.abs(velocity - mean).max())
        if reads == "all":
            left = frame["fuel"][nodes] / frame["fuel_initial"][nodes]
            for name, values in {
                "temperature": frame["temperature"][nodes],
                "burn": 1 - left,
                "fuel": left,
                "rest": frame["rest_position"][nodes],
                "id": nodes,
                "source": frame["source"][nodes],
                "origin_face": frame["origin_face"][nodes],
                "origin_a": frame["origin_points"][nodes, 0],
                "origin_b": frame["origin_points"][nodes, 1],
                "origin_c": frame["origin_points"][nodes, 2],
                "origin_weights": frame["origin_weights"][nodes],
            }.items():
                assert np.allclose(attribute(mesh, name), values, atol=1e-5), (number, name)
            values = frame["ashed"][nodes]
            assert np.allclose(attribute(mesh, "ash"), values, atol=1e-5), number
            for name in ("char", "age", "alive", "displayColor"):
                assert len(attribute(mesh, name)) == len(nodes), (number, name)
            for name in ("piece", "source_face", "sheet"):
                values = frame[f"triangle_{name}"][frame["triangle_alive"] == 1]
                assert np.array_equal(attribute(mesh, name), values), (number, name)
            pieces = frame["triangle_piece"][frame["triangle_alive"] == 1]
            for name in ("piece_parent", "piece_birth", "piece_mass", "piece_area", "piece_temperature"):
                values = frame[name][pieces].astype(np.int32 if name == "piece_parent" else np.float32)
                assert np.array_equal(attribute(mesh, name), values), (number, name)
        counts.append(len(corners))
    return counts
