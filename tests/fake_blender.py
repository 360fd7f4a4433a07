"""A program that answers as Blender does, or misbehaves as the name of the file tells."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

PROGRAM = '''#!{python}
import json, os, shutil, sys, time
import numpy as np

def say(answer):
    print(json.dumps(answer), flush=True)

def turned(frames, bones, speed):
    """A chain along z that turns about z, as it goes along x."""
    angle = speed * np.arange(frames) / 10
    worlds = np.zeros((frames, bones, 3, 4), dtype=np.float32)
    worlds[:, :, 0, 0] = worlds[:, :, 1, 1] = np.cos(angle)[:, None]
    worlds[:, :, 1, 0], worlds[:, :, 0, 1] = np.sin(angle)[:, None], -np.sin(angle)[:, None]
    worlds[:, :, 2, 2] = 1
    worlds[:, :, 0, 3] = np.arange(frames)[:, None] / 100
    worlds[:, :, 2, 3] = 1 + np.arange(bones) / 10
    return worlds

def clip(take, skeleton, number, frames, parents=(-1, 0, 1)):
    rest = np.tile(np.eye(4), (3, 1, 1))
    rest[:, 2, 3] = 1 + np.arange(3) / 10
    ARRAYS.update({{
        f"rest_{{number}}": rest, f"worlds_{{number}}": turned(frames, 3, number + 1),
        f"object_{{number}}": np.eye(4),
        f"objects_{{number}}": np.tile(np.eye(4)[:3], (frames, 1, 1)).astype(np.float32),
    }})
    return {{"take": take, "skeleton": skeleton, "names": ["hips", "spine", "spine_End"],
            "parents": list(parents), "fps": 29.9700301, "keyed": True}}

print("Fake 9.9 starts")
say({{"version": "9.9", "usable": "{usable}" == "yes"}})
folder = sys.argv[-1]
started = os.environ.get("FAKE_BLENDER_LOG")
if started:
    with open(started, "a") as log:
        log.write(os.environ["BLENDER_USER_RESOURCES"] + "\\n")
for line in sys.stdin:
    request, ARRAYS = json.loads(line), {{}}
    name = os.path.basename(request["path"])
    if request["do"] == "write":
        with np.load(request["arrays"]) as arrays:
            ARRAYS = {{key: arrays[key].shape for key in arrays.files}}
        with open(request["path"], "w") as file:
            json.dump(request | {{"shapes": ARRAYS}}, file)
        long = [name for name in request["names"] if len(name) > 10]
        say({{"renamed": [[name, name[:10]] for name in long]}})
        continue
    text = open(request["path"], errors="replace").read()
    if "hang" in text:
        time.sleep(60)
    if "crash" in text:
        print("out of its depth", file=sys.stderr, flush=True)
        os._exit(7)
    if "noise" in text:
        print("importing ...", flush=True)
        print("[1, 2]", flush=True)
    answer = {{"skeletons": ["Ann"], "objects": {{"armature": 1}}, "clips": []}}
    if "refuse" in text:
        answer = {{"error": "Blender says: not an FBX"}}
    elif "mesh" in text:
        answer |= {{"skeletons": [], "objects": {{"mesh": 2}}}}
    elif "two" in text:
        answer["clips"] = [clip("Walk", "Ann", 0, 12), clip("Run fast", "Ann", 1, 8)]
    elif "takes" in text:
        answer["clips"] = [clip("Walk", "Ann", 0, 12), clip("Run", "Ann", 1, 8)]
    elif "actors" in text:
        answer["clips"] = [clip("Walk", "Ann", 0, 12), clip("Walk", "Bob", 1, 12)]
    elif "roots" in text:
        answer["clips"] = [clip("Walk", "Ann", 0, 12, (-1, 0, -1))]
    elif "pose" not in text:
        answer["clips"] = [clip("Walk", "Ann", 0, 12)]
    with open(request["out"], "wb") as file:
        np.savez(file, **ARRAYS)
    say(answer)
shutil.rmtree(folder, ignore_errors=True)
'''


def make_blender(folder: Path, *, usable: bool = True) -> Path:
    """Write the program, and return where it is."""
    path = folder / ("blender" if usable else "old_blender")
    path.write_text(PROGRAM.format(python=sys.executable, usable="yes" if usable else "no"))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def scene(path: Path, text: str = "", *, unit_cm: float = 100.0, up: int = 1) -> Path:
    """Write an FBX as text, of which the program reads the words alone."""
    path.write_text(
        "; FBX 7.4.0 project file\n"
        "GlobalSettings:  {\n\tProperties70:  {\n"
        f'\t\tP: "UpAxis", "int", "Integer", "",{up}\n'
        f'\t\tP: "UnitScaleFactor", "double", "Number", "",{unit_cm}\n\t}}\n}}\n'
        f"; LimbNode AnimationCurve {text}\n"
    )
    return path
