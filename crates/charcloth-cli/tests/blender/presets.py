"""Presets of the add-on are the materials of the program and the built-in scenes they are named after. Needs no Blender.

Arguments: folder of the repository, what `charcloth list materials` says.
"""

import re
import sys
import tomllib
from pathlib import Path

home, listed = Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(home / "blender" / "charcloth"))
import presets  # noqa: E402

UNITS = {"%": 0.01, "mm": 1e-3, "g/m2": 1e-3, "MJ/kg": 1e6, "mN m": 1e-3}
SI = {"s", "m", "m2/s", "N/m", "1/s", "1/K", "Pa/K", "kg/m2"}


def plain(value):
    """A quantity as a number in SI."""
    if not isinstance(value, str):
        return value
    number, unit = re.fullmatch(r"([-+.\deE]+) (.+)", value).groups()
    assert unit in UNITS or unit in SI, unit
    return float(number) * UNITS.get(unit, 1.0)


def same(one, other):
    """Equal but for rounding."""
    return one == other or abs(one - other) < 1e-9 * abs(other)


materials = dict(re.split(r"\s{2,}", line.strip(), maxsplit=1) for line in listed.strip().splitlines())
assert list(materials) and set(presets.MEASURED) == set(materials), set(presets.MEASURED) ^ set(materials)
for name, preset in presets.MEASURED.items():
    assert preset.about == materials[name], (preset.about, materials[name])
    sheet = tomllib.loads((home / "materials" / f"{name}.toml").read_text())["sheet"]
    keys = preset.keys["sheet"]
    assert preset.model == "physical" and preset.keys.keys() == {"sheet"} and keys["material"] == name
    # docs/scenes.md: 0.1 mm and 25 mm where the material does not say.
    for key, default in (("cockle", "0.1 mm"), ("cockle_length", "25 mm")):
        assert same(keys[key], plain(sheet.get(key, {"value": default})["value"])), (name, key)

compared = 0
for name, preset in presets.SKETCHES.items():
    scene = preset.about.rpartition(" As the scene ")[2]
    if scene == preset.about:
        continue
    there = tomllib.loads((home / "scenes" / f"{scene}.toml").read_text())
    for table, keys in preset.keys.items():
        values = there
        for part in table.split("."):
            values = values[part]
        for key, value in keys.items():
            assert same(value, plain(values[key])), (name, table, key, value, values[key])
            compared += 1
assert compared > 30, compared
print("SOUND", len(materials), "materials", compared, "numbers")
