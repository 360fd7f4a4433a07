"""Draw the pictures of the README and the docs, from synthetic motion.

python scripts/make_pictures.py
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

from matplotlib import pyplot

from mocapdb.compression import Target, decode, encode
from mocapdb.corpus import synthetic
from mocapdb.plots import rate_distortion, skeleton_strip

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
TARGETS_MM = (0.3, 1.0, 3.0, 10.0, 30.0)


def main() -> None:
    """Draw a walk before and after coding, beside what an error costs."""
    clip = synthetic.make_clip("walk", seed=7, n_cycles=3, heading_deg=90.0)
    figure, (left, right) = pyplot.subplots(
        1, 2, figsize=(11, 2.9), width_ratios=(2.6, 1), layout="constrained"
    )
    payload = encode(clip, Target("mean_mm", 10.0))
    coded = clip.replace(channels=decode(payload.data, clip.skeleton))
    rate = len(payload.data) / len(clip)
    strip = {"as captured": clip, f"10 mm off, {rate:.0f} bytes a frame": coded}
    skeleton_strip(strip, n_poses=9, ax=left)
    curves = {}
    for name, choice in (("DCT", "dct"), ("DWT", "dwt")):
        payloads = [
            encode(clip, Target("mean_mm", mm), codec="okane", transform=choice)
            for mm in TARGETS_MM
        ]
        curves[f"O'Kane, {name}"] = [
            (len(payload.data) / len(clip), payload.error.vertices.mean) for payload in payloads
        ]
    rate_distortion(curves, ax=right)
    PICTURES.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURES / "walk.png", dpi=90)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    main()
