"""Rows of `charcloth check scenes/validation/*.toml`, read from standard input, as a table on standard output."""
import re
import sys

print("# Speeds of flames: charcloth check scenes/validation/NAME.toml. nan: the front did not come by.")
print("scene,case,value,speed_mm_s,verdict")
scene = case = ""
for line in sys.stdin:
    title = re.match(r".*validation/(\w+)(?:\.toml)?: (.*)", line)
    if title:
        scene, case = title.groups()
    row = re.match(r"\s+(pass|FAIL)\s+(speed|ignition)\s+(.*)", line)
    if row:
        # Columns are two spaces apart.
        got = re.split(r"\s{2,}", row[3])[1]
        number = re.search(r"-?\d+(\.\d+)?", case)
        factor = 1e3 if row[2] == "speed" else 1
        print(f"{scene},{case.replace(',', ';')},{number[0] if number else ''},{float(got) * factor:.4g},{row[1]}")
