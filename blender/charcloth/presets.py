"""Materials: tables of scene keys. Those of the model `physical` are the measured materials of the program
(`charcloth list materials`), the others sketches, each as in the built-in scene it is named after.
"""

from dataclasses import dataclass
from typing import Any

PHYSICAL = "physical"
SKETCH = "moidu2004"


@dataclass(frozen=True)
class Preset:
    """A material: what it is called, and the keys of a scene (docs/scenes.md) that make it."""

    label: str
    about: str
    keys: dict[str, dict[str, Any]]
    model: str = SKETCH
    spacing: float = 0.0035  # distance of points that goes with it [m]
    burn_level: int = 0


def _measured(name: str, label: str, about: str, cockle: float = 1e-4, cockle_length: float = 0.025) -> Preset:
    """A material of the program, which knows all but how a mesh from elsewhere is cockled [m]."""
    keys = {"sheet": {"material": name, "cockle": cockle, "cockle_length": cockle_length}}
    return Preset(label, about, keys, PHYSICAL, 0.005, 2)


MEASURED: dict[str, Preset] = {
    "copy_paper_80": _measured("copy_paper_80", "Copy paper", "office paper of 80 g/m2 with chalk filler"),
    "newsprint_45": _measured("newsprint_45", "Newsprint", "newsprint of 45 g/m2"),
    "tissue": _measured(
        "tissue", "Tissue", "laboratory tissue of 18.7 g/m2, the sheet of most flame-spread measurements"
    ),
    "filter_paper": _measured("filter_paper", "Filter paper", "filter paper of 75 g/m2, nearly pure cellulose"),
    "card_200": _measured("card_200", "Card", "card of 200 g/m2", 4e-5, 0.035),
    "cardboard_liner": _measured("cardboard_liner", "Cardboard liner", "liner of corrugated board, kraft, 150 g/m2"),
    "cotton_sheet": _measured("cotton_sheet", "Cotton", "cotton bed sheet of 120 g/m2", 3e-4, 0.04),
    "polyester_cotton": _measured(
        "polyester_cotton", "Polyester and cotton", "65/35 polyester and cotton of 120 g/m2"
    ),
    "denim": _measured("denim", "Denim", "cotton denim of 400 g/m2"),
    "wool": _measured("wool", "Wool", "wool cloth of 235 g/m2"),
}

SKETCHES: dict[str, Preset] = {
    "film": Preset(
        "Copy paper, film speed",
        "Sheet of 80 g/m2 that burns at about 35 mm/s: A4 in eight seconds. As the scene a4",
        {
            "sheet": {"grammage": 0.080},
            "sheet.variation": {"noise": 0.20, "correlation_length": 0.007},
            "fire": {"burn_time": 0.34, "heat_of_combustion": 1.35e6, "diffusivity": 1.4e-4},
            "mechanics": {"structural": 90.0, "flexion": 9.0, "strength": 16.0, "damping": 2.0},
            "thermal_force": {"contraction": 2.5e-4},
            "curl": {"pressure": 0.004},
        },
    ),
    "real": Preset(
        "Copy paper, real speed",
        "Sheet of 80 g/m2 that burns at about 2.7 mm/s, as measured on paper. Wants a spacing of 1 mm",
        {"mechanics": {"strength": 16.0, "damping": 2.0}},
    ),
    "curl": Preset(
        "Curling paper",
        "The burning edge curls over and nothing tears. As the scene curl",
        {
            "sheet.variation": {"noise": 0.15, "correlation_length": 0.008},
            "fire": {"burn_time": 0.7, "heat_of_combustion": 1.3e6, "diffusivity": 1.6e-4},
            "mechanics": {"structural": 50.0, "flexion": 5.0, "damping": 3.0},
            "thermal_force": {"contraction": 1.5e-4},
            "curl": {"pressure": 0.012},
        },
    ),
    "tear": Preset(
        "Tearing paper",
        "Weak sheet; cracks run ahead of the fire where it is stretched. As the scene tear",
        {
            "sheet.variation": {"noise": 0.25, "correlation_length": 0.009},
            "fire": {"burn_time": 0.8, "heat_of_combustion": 1.3e6, "diffusivity": 1.6e-4},
            "mechanics": {"structural": 60.0, "flexion": 4.0, "strength": 7.0, "damping": 2.0},
            "thermal_force": {"contraction": 1e-4},
            "curl": {"pressure": 0.005},
        },
    ),
    "flake": Preset(
        "Flaking paper",
        "Very uneven sheet; fires go round its thick places, which come off and fall. As the scene flake",
        {
            "sheet.variation": {"noise": 0.85, "correlation_length": 0.014},
            "fire": {"burn_time": 0.35, "heat_of_combustion": 1.3e6, "diffusivity": 1.1e-4},
            "mechanics": {"structural": 50.0, "flexion": 4.0, "strength": 5.0, "damping": 2.0},
            "thermal_force": {"contraction": 1e-4},
            "curl": {"pressure": 0.004},
        },
    ),
}

PRESETS = {**MEASURED, **SKETCHES}
