"""Attributes under names that shaders can read.

Cycles takes some names for grids of a volume and finds nothing of that name on a mesh: `temperature` is one. A geometry
node tree behind the cache copies it to `kelvin`.
"""

import bpy

NAME = "Charcloth attributes"
COPIES = {"temperature": "kelvin"}


def add_copies(burnt: bpy.types.Object) -> None:
    """Puts the tree behind the cache of a burnt sheet."""
    modifier = burnt.modifiers.new(NAME, "NODES")
    modifier.node_group = bpy.data.node_groups.get(NAME) or build_tree()


def build_tree() -> bpy.types.NodeTree:
    """The tree: geometry in, the same geometry with the copies out."""
    tree = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    tree.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    geometry = tree.nodes.new("NodeGroupInput").outputs[0]
    for number, (name, copy) in enumerate(COPIES.items()):
        known = tree.nodes.new("GeometryNodeInputNamedAttribute")
        known.data_type = "FLOAT"
        known.inputs["Name"].default_value = name
        store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
        store.data_type, store.domain = "FLOAT", "POINT"
        store.inputs["Name"].default_value = copy
        known.location, store.location = (220 * number, -200), (220 * (number + 1), 0)
        tree.links.new(geometry, store.inputs["Geometry"])
        value = next(output for output in known.outputs if output.name == "Attribute" and output.enabled)
        tree.links.new(value, next(i for i in store.inputs if i.name == "Value" and i.enabled))
        geometry = store.outputs["Geometry"]
    out = tree.nodes.new("NodeGroupOutput")
    out.location = (220 * (len(COPIES) + 2), 0)
    tree.links.new(geometry, out.inputs[0])
    return tree
