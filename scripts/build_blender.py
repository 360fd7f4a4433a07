#!/usr/bin/env python3
"""Build the Blender extension: a zip with the add-on and the wheels that it needs.

Blender's Python has numpy and little else, so that mocapdb and what it needs come along, as
extensions do it: in ``wheels/``, named in the manifest. They are fetched for Blender's Python, not
for the one that runs this, and numpy is left out, for Blender's own is used.

    python scripts/build_blender.py                       # for this machine
    python scripts/build_blender.py --platform windows-x64
    python scripts/build_blender.py --light               # lists, decodes slowly, extracts nothing
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ADDON = ROOT / "blender"
PYTHON = "3.11"  # Blender's, 4.5 and 5.0
NUMPY = "numpy==1.26.4"  # Blender's: what comes along has to work with it
PLATFORMS = {  # Blender's names of platforms, and those of wheels that run there
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64",
                  "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_14_0_arm64", "macosx_12_0_arm64", "macosx_11_0_arm64"),
}  # fmt: skip
LIGHT = ("h5py", "scipy")  # enough to list and to decode
FIXED_TIME = (2020, 1, 1, 0, 0, 0)  # of the files in the zip, so that it is the same every time


def main(arguments: Sequence[str] | None = None) -> Path:
    """Build the zip that the command line asks for, and return it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--platform", choices=PLATFORMS, default=this_platform())
    parser.add_argument("--light", action="store_true", help=f"only mocapdb, {', '.join(LIGHT)}")
    parser.add_argument("--no-wheels", action="store_true", help="for a Python that has mocapdb")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "dist")
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        wheels: list[Path] = []
        if not asked.no_wheels:
            wheels = fetch_wheels(Path(folder), asked.platform, light=asked.light)
        kind = "-light" if asked.light else ""
        made = write_zip(asked.output, asked.platform if wheels else "", wheels, kind)
    print(f"{made}: {made.stat().st_size / 1e6:.1f} MB, {len(wheels)} wheels")
    return made


def this_platform() -> str:
    """Return Blender's name of the platform that this runs on."""
    return {"Windows": "windows-x64", "Darwin": "macos-arm64"}.get(platform.system(), "linux-x64")


def fetch_wheels(folder: Path, where: str, *, light: bool) -> list[Path]:
    """Build mocapdb's wheel, fetch what it needs, and return all but numpy's."""
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    own = [*pip, "wheel", "--no-deps", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run(own, check=True)
    (mocapdb,) = folder.glob("mocapdb-*.whl")
    fetch = [*pip, "download", "--dest", str(folder), "--only-binary", ":all:", NUMPY]
    fetch += ["--python-version", PYTHON, "--implementation", "cp"]
    for tag in PLATFORMS[where]:
        fetch += ["--platform", tag]
    subprocess.run([*fetch, *(LIGHT if light else [str(mocapdb)])], check=True)
    return sorted(path for path in folder.glob("*.whl") if not path.name.startswith("numpy-"))


def write_zip(output: Path, where: str, wheels: Sequence[Path], kind: str = "") -> Path:
    """Write the extension with some wheels, and return its file."""
    manifest = (ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    version = tomllib.loads(manifest)["version"]
    output.mkdir(parents=True, exist_ok=True)
    path = output / f"mocapdb-blender-{version}{f'-{where}' if where else ''}{kind}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(ADDON.glob("*")):
            if file.suffix == ".py" or file.name in {"LICENSE", "README.md"}:
                add(archive, file.name, file.read_bytes())
        add(archive, "blender_manifest.toml", with_wheels(manifest, where, wheels).encode())
        for wheel in wheels:
            add(archive, f"wheels/{wheel.name}", wheel.read_bytes())
    return path


def with_wheels(manifest: str, where: str, wheels: Sequence[Path]) -> str:
    """Return a manifest that names the platform and the wheels."""
    if not wheels:
        return manifest
    lines = [f'platforms = ["{where}"]', "wheels = ["]
    lines += [f'  "./wheels/{wheel.name}",' for wheel in wheels]
    top, table, rest = manifest.partition("[permissions]")
    return top + "\n".join([*lines, "]", "", ""]) + table + rest


def add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    """Put a file into a zip; a wheel is packed already."""
    kind = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
    archive.writestr(zipfile.ZipInfo(name, FIXED_TIME), content, kind)


if __name__ == "__main__":
    main()
