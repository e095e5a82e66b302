"""How burnt paper is drawn: a node tree that reads the attributes of the loaded mesh.

`char` goes from white over brown (0.5) to char (1), `ash` is the fraction of the char that is gone (in a sketch: of the
fuel), `kelvin` is the temperature (see `attributes`), `rest` is the place in the sheet [m], so that the grain sticks to
the paper. Holes are geometry; only their rim, which has the width of a triangle, is frayed by transparency.
"""

from collections.abc import Callable
from typing import Any

import bpy

from .scene_file import physical

NAME = "Charcloth paper"

# Colours, linear. tuned by eye: paper as it is printed on, scorch from straw to coffee, char nearly black, ash grey.
PAPER = (0.82, 0.79, 0.72, 1.0)
SCORCH = (
    (0.00, PAPER),
    (0.10, (0.72, 0.62, 0.44, 1.0)),
    (0.26, (0.36, 0.20, 0.08, 1.0)),
    (0.45, (0.09, 0.040, 0.016, 1.0)),
    (0.62, (0.016, 0.010, 0.008, 1.0)),
    (1.00, (0.010, 0.009, 0.009, 1.0)),
)
ASH = (0.16, 0.155, 0.15, 1.0)
GRAIN = 700.0  # [1/m]: fibres and specks of 1.5 mm
CLOUDS = 110.0  # [1/m]: patches of 1 cm
ASHEN, SKETCHED_ASHEN = (0.25, 0.75), (0.68, 0.84)  # part gone between which char turns grey; tuned by eye
GLOW_FROM, GLOW_TO, SKETCHED_GLOW_TO = 850.0, 1350.0, 1150.0  # [K]: dull red to orange
GLOW_COLORS = (1350.0, 1900.0)  # [K] tuned: red to orange as films show embers; of the true ones a camera sees dull red
GLOW_RISES, GLOW_FALLS = (0.36, 0.50), (0.58, 0.74)  # part of the fuel gone; tuned: a line, with char on both sides
GLOW = 1.5  # tuned: as bright as paper in daylight; brighter, AgX turns it pink
FRAY_FROM = 0.78  # part gone at which the rim begins to fray


def burn_material(sheet: bpy.types.Object) -> bpy.types.Material:
    """The material of a sheet's burnt self, made once and then left to the artist."""
    name = f"{NAME} {sheet.name}" if physical(sheet.charcloth) else f"{NAME} {sheet.name} sketched"
    return known_or_built(name, lambda name: build_material(name, physical(sheet.charcloth)))


def known_or_built(name: str, build: Callable[[str], bpy.types.Material]) -> bpy.types.Material:
    """The material of that name, built unless it is there already."""
    known = bpy.data.materials.get(name)
    return known if known is not None else build(name)


def build_material(name: str, measured: bool) -> bpy.types.Material:
    """A new material of burning paper: of a measured one, or of a sketch."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = Tree(material.node_tree)
    char, ash, kelvin = (tree.attribute(key) for key in ("char", "ash", "kelvin"))
    rest = tree.attribute("rest", "Vector")
    grain = tree.noise(rest, GRAIN, "Grain")
    clouds = tree.noise(rest, CLOUDS, "Clouds")

    # The border of the scorch wanders by patches and specks, most where it is half done.
    wander = tree.math("ADD", tree.spread(clouds, 0.9), tree.spread(grain, 0.6))
    open_part = tree.math("MULTIPLY", char, tree.math("SUBTRACT", 1.0, char))
    dark = tree.math("ADD", char, tree.math("MULTIPLY", tree.math("MULTIPLY", wander, 4.0), open_part), clamp=True)
    scorched = tree.ramp(dark, SCORCH, "Scorch")

    # What has burnt out is ash: grey, in specks.
    ashen = tree.between(tree.math("ADD", ash, tree.spread(grain, 0.8)), *(ASHEN if measured else SKETCHED_ASHEN))
    color = tree.mix(ashen, scorched, ASH, "Ash")

    # What is hot glows; of a sketch only what still burns, for it keeps its heat.
    glow_to = GLOW_TO if measured else SKETCHED_GLOW_TO
    strength = tree.math("MULTIPLY", tree.value(GLOW, "Glow"), tree.between(kelvin, GLOW_FROM, glow_to))
    embers = [tree.between(grain, 0.36, 0.64)]
    if not measured:
        ragged = tree.math("ADD", ash, tree.spread(clouds, 0.5))
        embers += [tree.between(ragged, *GLOW_RISES), tree.between(ragged, *GLOW_FALLS, (1.0, 0.0))]
    for factor in embers:
        strength = tree.math("MULTIPLY", strength, factor)

    paper = tree.node("ShaderNodeBsdfPrincipled", "Paper", {"Roughness": 0.85, "Specular IOR Level": 0.25})
    tree.link(color, paper.inputs["Base Color"])
    shown = tree.between(kelvin, GLOW_FROM, glow_to, GLOW_COLORS)
    tree.link(tree.blackbody(shown), paper.inputs["Emission Color"])
    tree.link(strength, paper.inputs["Emission Strength"])
    tree.link(tree.bump(tree.math("MULTIPLY", grain, dark)), paper.inputs["Normal"])
    frayed = tree.between(tree.math("ADD", ash, tree.spread(grain, 0.7)), FRAY_FROM, FRAY_FROM + 0.04)
    alpha = tree.math("SUBTRACT", 1.0, frayed)

    # Light comes through paper, not through char.
    behind = tree.node("ShaderNodeBsdfTranslucent", "Light From Behind", {})
    tree.link(color, behind.inputs["Color"])
    through = tree.math("MULTIPLY", tree.math("SUBTRACT", 1.0, dark), tree.value(0.35, "Translucency"))
    surface = tree.shaders(through, paper.outputs["BSDF"], behind.outputs["BSDF"])
    clear = tree.node("ShaderNodeBsdfTransparent", "Hole", {})
    tree.finish(tree.shaders(alpha, clear.outputs["BSDF"], surface))
    return material


class Tree:
    """A node tree as it grows. Methods take and give sockets; numbers stand for themselves."""

    def __init__(self, nodes: bpy.types.NodeTree) -> None:
        self.tree = nodes
        nodes.nodes.clear()

    def node(self, kind: str, label: str, values: dict[str, Any]) -> bpy.types.Node:
        """A node with values of its inputs; it stands to the right of those before it."""
        node = self.tree.nodes.new(kind)
        node.label = label
        count = len(self.tree.nodes)
        node.location = (220 * (count // 5), -190 * (count % 5))
        for name, value in values.items():
            self.link(value, node.inputs[name])
        return node

    def link(self, source: Any, target: bpy.types.NodeSocket) -> None:
        """Joins an output or sets a value."""
        if isinstance(source, bpy.types.NodeSocket):
            self.tree.links.new(source, target)
        else:
            target.default_value = source

    def attribute(self, name: str, output: str = "Fac") -> bpy.types.NodeSocket:
        """An attribute of the mesh."""
        node = self.node("ShaderNodeAttribute", name, {})
        node.attribute_name = name
        return node.outputs[output]

    def value(self, value: float, label: str) -> bpy.types.NodeSocket:
        """A number for the artist to change."""
        node = self.node("ShaderNodeValue", label, {})
        node.outputs[0].default_value = value
        return node.outputs[0]

    def math(self, operation: str, first: Any, second: Any, clamp: bool = False) -> bpy.types.NodeSocket:
        """A sum, product or power."""
        node = self.node("ShaderNodeMath", operation.title(), {})
        node.operation, node.use_clamp = operation, clamp
        self.link(first, node.inputs[0])
        self.link(second, node.inputs[1])
        return node.outputs[0]

    def noise(self, place: bpy.types.NodeSocket, scale: float, label: str) -> bpy.types.NodeSocket:
        """Noise about one half."""
        node = self.node("ShaderNodeTexNoise", label, {"Vector": place, "Scale": scale, "Detail": 4.0})
        return node.outputs["Fac"] if "Fac" in node.outputs else node.outputs[0]

    def spread(self, noise: bpy.types.NodeSocket, height: float) -> bpy.types.NodeSocket:
        """Noise about zero, `height` from its low to its high."""
        return self.math("MULTIPLY", self.math("SUBTRACT", noise, 0.5), height)

    def between(
        self, value: Any, low: float, high: float, to: tuple[float, float] = (0.0, 1.0)
    ) -> bpy.types.NodeSocket:
        """From one value below `low` to another above `high`, smooth between."""
        node = self.node("ShaderNodeMapRange", f"{low:g} to {high:g}", {})
        node.interpolation_type = "SMOOTHSTEP"
        names = ("Value", "From Min", "From Max", "To Min", "To Max")
        for name, source in zip(names, (value, low, high, *to), strict=True):
            self.link(source, node.inputs[name])
        return node.outputs[0]

    def ramp(self, value: Any, stops: tuple, label: str) -> bpy.types.NodeSocket:
        """Colours along a number."""
        node = self.node("ShaderNodeValToRGB", label, {"Fac": value})
        elements = node.color_ramp.elements
        while len(elements) < len(stops):
            elements.new(1.0)
        for element, (place, color) in zip(elements, stops, strict=True):
            element.position, element.color = place, color
        return node.outputs["Color"]

    def mix(self, factor: Any, first: Any, second: Any, label: str) -> bpy.types.NodeSocket:
        """One colour by another."""
        node = self.node("ShaderNodeMix", label, {})
        node.data_type = "RGBA"
        self.link(factor, node.inputs[0])
        self.link(first, node.inputs[6])
        self.link(second, node.inputs[7])
        return node.outputs[2]

    def blackbody(self, kelvin: Any) -> bpy.types.NodeSocket:
        """The colour of what glows."""
        return self.node("ShaderNodeBlackbody", "Glow Colour", {"Temperature": kelvin}).outputs[0]

    def bump(self, height: Any) -> bpy.types.NodeSocket:
        """Char is crinkled."""
        values = {"Strength": 0.35, "Distance": 0.0006, "Height": height}
        return self.node("ShaderNodeBump", "Crinkles", values).outputs[0]

    def shaders(self, factor: Any, first: Any, second: Any) -> bpy.types.NodeSocket:
        """One shader by another."""
        node = self.node("ShaderNodeMixShader", "Mix", {})
        for source, target in zip((factor, first, second), node.inputs, strict=True):
            self.link(source, target)
        return node.outputs[0]

    def finish(self, shader: bpy.types.NodeSocket, what: str = "Surface") -> None:
        """The surface, or the volume, goes to the output."""
        self.link(shader, self.node("ShaderNodeOutputMaterial", "", {}).inputs[what])
