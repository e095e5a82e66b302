"""Packs the add-on: charcloth-blender-<version>.zip in a folder (default: this one), the same bytes every time.

python3 blender/package.py [FOLDER]
"""

import sys
import tomllib
import zipfile
from pathlib import Path

HOME = Path(__file__).resolve().parent
SOURCE = HOME / "charcloth"
WHEN = (1980, 1, 1, 0, 0, 0)  # the first time a zip can say


def package(folder: Path) -> Path:
    """Writes the archive and returns its path."""
    version = tomllib.loads((SOURCE / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    path = folder / f"charcloth-blender-{version}.zip"
    partial = path.with_suffix(".zip.partial")
    with zipfile.ZipFile(partial, "w") as archive:
        for file in sorted(SOURCE.iterdir()):
            if file.suffix in {".py", ".toml"}:
                entry = zipfile.ZipInfo(file.name, WHEN)
                entry.external_attr = 0o644 << 16
                entry.create_system = 3
                # Stored: deflated bytes differ from one version of zlib to the next.
                archive.writestr(entry, file.read_bytes())
    partial.replace(path)
    return path


if __name__ == "__main__":
    print(package(Path(sys.argv[1]) if len(sys.argv) > 1 else HOME))
