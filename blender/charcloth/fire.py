"""How flames are drawn: a volume that emits by the grids `flame` (how dense, 0 to 1) and `temperature` [K].

Hot soot shines as a black body does, and a film that shall show anything else beside it shows flames far too dim: the
strength is that of a picture, not of nature.
"""

import bpy

from .material import Tree, known_or_built

NAME = "Charcloth fire"
STRENGTH = 180.0  # [1/m] tuned by eye: flames shine through each other and stay yellow, not white
LEAN = 2.2  # tuned: 1 to 3; how much faster than its density a flame fades at its border
WARM = 1.2  # tuned: 1.1 to 1.4; at the true 1300 to 1900 K the view transform AgX turns flames pink


def fire_material(sheet: bpy.types.Object) -> bpy.types.Material:
    """The material of a sheet's flames, made once and then left to the artist."""
    return known_or_built(f"{NAME} {sheet.name}", build_fire)


def build_fire(name: str) -> bpy.types.Material:
    """A new material of flames."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = Tree(material.node_tree)
    grids = tree.node("ShaderNodeVolumeInfo", "Flames", {})
    lean = tree.math("POWER", grids.outputs["Flame"], tree.value(LEAN, "Lean"))
    strength = tree.math("MULTIPLY", lean, tree.value(STRENGTH, "Strength"))
    kelvin = tree.math("MULTIPLY", grids.outputs["Temperature"], tree.value(WARM, "Warmth"))
    emission = tree.node("ShaderNodeEmission", "Soot", {"Color": tree.blackbody(kelvin), "Strength": strength})
    tree.finish(emission.outputs[0], "Volume")
    return material
