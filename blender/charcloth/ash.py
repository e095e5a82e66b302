"""How particles are drawn: ash and crumbs as scraps of char that tumble while they fall and lie flat where they lie.

The points have a `radius`, a velocity, `temperature` [K], `age` [s] and `lies`; a geometry node tree puts a scrap on each.
"""

from typing import Any

import bpy

from .material import Tree, known_or_built

NAME = "Charcloth ash"
CORNERS = 7
SPIN = 9.0  # [1/s] tuned: scraps of 4 mm turn over once or twice a second as they flutter
TURN = 6.2832
CHAR = (0.012, 0.011, 0.010, 1.0)
ASH = (0.16, 0.155, 0.15, 1.0)
GLOW_FROM, GLOW_TO = 800.0, 1150.0  # [K]: dull red to orange, as of the sheet
GLOW_COLORS = (1350.0, 1900.0)  # [K] tuned, as of the sheet
GLOW = 3.0  # tuned by eye


def ash_material(sheet: bpy.types.Object) -> bpy.types.Material:
    """The material of a sheet's particles, made once and then left to the artist."""
    return known_or_built(f"{NAME} {sheet.name}", build_material)


def build_material(name: str) -> bpy.types.Material:
    """Char that glows while it is hot, and turns to ash with the years of a scrap."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = Tree(material.node_tree)
    kelvin, age = tree.attribute("kelvin"), tree.attribute("age")
    color = tree.mix(tree.between(age, 0.2, 2.0), CHAR, ASH, "Ash")
    paper = tree.node("ShaderNodeBsdfPrincipled", "Scrap", {"Roughness": 0.9, "Specular IOR Level": 0.2})
    tree.link(color, paper.inputs["Base Color"])
    tree.link(tree.blackbody(tree.between(kelvin, GLOW_FROM, GLOW_TO, GLOW_COLORS)), paper.inputs["Emission Color"])
    strength = tree.math("MULTIPLY", tree.between(kelvin, GLOW_FROM, GLOW_TO), tree.value(GLOW, "Glow"))
    tree.link(strength, paper.inputs["Emission Strength"])
    tree.finish(paper.outputs["BSDF"])
    return material


def give_shape(ash: bpy.types.Object, material: bpy.types.Material) -> None:
    """Puts the tree behind the cache of the particles."""
    modifier = ash.modifiers.new(NAME, "NODES")
    modifier.node_group = build_tree(f"{NAME} {ash.name}", material)


def build_tree(name: str, material: bpy.types.Material) -> bpy.types.NodeTree:
    """The tree: points in, scraps out."""
    known = bpy.data.node_groups.get(name)
    if known is not None:
        return known
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")

    def node(kind: str, values: dict[str, Any] | None = None, **settings: Any) -> bpy.types.Node:
        made = tree.nodes.new(kind)
        count = len(tree.nodes)
        made.location = (220 * (count // 4), -190 * (count % 4))
        for key, value in settings.items():
            setattr(made, key, value)
        for key, value in (values or {}).items():
            link(value, next(i for i in made.inputs if i.name == key and i.enabled))
        return made

    def link(source: Any, target: bpy.types.NodeSocket) -> None:
        if isinstance(source, bpy.types.NodeSocket):
            tree.links.new(source, target)
        else:
            target.default_value = source

    def out(made: bpy.types.Node, key: str | int = 0) -> bpy.types.NodeSocket:
        enabled = [o for o in made.outputs if o.enabled]
        return enabled[key] if isinstance(key, int) else next(o for o in enabled if o.name == key)

    def known_attribute(key: str, kind: str) -> bpy.types.NodeSocket:
        return out(node("GeometryNodeInputNamedAttribute", {"Name": key}, data_type=kind), "Attribute")

    points = out(node("NodeGroupInput"))
    # A crumpled disc of radius 1.
    disc = out(node("GeometryNodeMeshCircle", {"Vertices": CORNERS, "Radius": 1.0}, fill_type="TRIANGLE_FAN"))
    crumple = node("FunctionNodeRandomValue", {"Min": (-0.25, -0.25, -0.35), "Max": (0.25, 0.25, 0.35)}, data_type="FLOAT_VECTOR")
    scrap = out(node("GeometryNodeSetPosition", {"Geometry": disc, "Offset": out(crumple)}))
    # Each has a turn and a spin of its own; what lies is flat.
    number = known_attribute("id", "INT")
    start = out(node("FunctionNodeRandomValue", {"Max": (TURN, TURN, TURN), "ID": number, "Seed": 1}, data_type="FLOAT_VECTOR"))
    spin = node("FunctionNodeRandomValue", {"Min": (-SPIN,) * 3, "Max": (SPIN,) * 3, "ID": number, "Seed": 2}, data_type="FLOAT_VECTOR")
    age = known_attribute("age", "FLOAT")
    turned = node("ShaderNodeVectorMath", operation="SCALE")
    link(out(spin), turned.inputs[0])
    link(age, turned.inputs["Scale"])
    angle = node("ShaderNodeVectorMath", operation="ADD")
    link(start, angle.inputs[0])
    link(out(turned), angle.inputs[1])
    lies = known_attribute("lies", "INT")
    stands = out(node("ShaderNodeMath", operation="SUBTRACT"))
    stands.node.inputs[0].default_value = 1.0
    link(lies, stands.node.inputs[1])
    held = node("ShaderNodeVectorMath", operation="SCALE")
    link(out(angle), held.inputs[0])
    link(stands, held.inputs["Scale"])
    rotation = out(node("FunctionNodeEulerToRotation", {"Euler": out(held)}))
    radius = out(node("GeometryNodeInputRadius"))
    scraps = node("GeometryNodeInstanceOnPoints", {"Points": points, "Instance": scrap, "Rotation": rotation, "Scale": radius})
    real = out(node("GeometryNodeRealizeInstances", {"Geometry": out(scraps)}))
    # Cycles takes some names for grids of a volume (see `attributes`).
    kelvin = node("GeometryNodeStoreNamedAttribute", {"Geometry": real, "Name": "kelvin", "Value": known_attribute("temperature", "FLOAT")}, data_type="FLOAT", domain="POINT")
    painted = node("GeometryNodeSetMaterial", {"Geometry": out(kelvin), "Material": material})
    link(out(painted), node("NodeGroupOutput").inputs[0])
    return tree
