"""Fit the constants of the fault detector: mocapdb/cleaning/data/calibration.json.

    python scripts/fit_cleaning.py CORPUS

Faults are injected into the clean joints of clips of the calibration subjects (CMU's 01, 03, 05,
08, 16 and 35, and a quarter of HDM05's clips), at 120, 60 and 30 frames a second. What is kept is
two dozen numbers over all of them.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from sklearn.linear_model import LogisticRegression

from mocapdb.cleaning.detector import FEATURES, evidence_matrix, find_clip_consensus
from mocapdb.cleaning.evaluation import make_trials
from mocapdb.cleaning.hypotheses import find_hypotheses
from mocapdb.cleaning.jumps import find_jumps
from mocapdb.cleaning.texture import local_rotations, motion_texture
from mocapdb.io import read_clip

SUBJECTS = ("01", "03", "05", "08", "16", "35")
STEPS = (1, 1, 2, 4)  # 120, 120, 60 and 30 frames a second
LONGEST_FRAMES = 4000
WRONG, NEITHER, RIGHT = 0.4, 0.2, 0.1  # share of a fault from which a hypothesis is one
THRESHOLD = 0.3
OUTPUT = Path(__file__).parents[1] / "mocapdb" / "cleaning" / "data" / "calibration.json"


def calibration_clips(corpus: Path):
    """Yield the clips of the calibration subjects."""
    for path in sorted((corpus / "cmu").rglob("*")):
        subject = path.stem.split("_")[0]
        is_clip = path.suffix in {".amc", ".bvh"} and "daz" not in str(path)
        if is_clip and subject in SUBJECTS:
            yield read_clip(path, drop_tpose=True)
    for path in sorted((corpus / "hdm05").rglob("*.amc"))[::4]:
        yield read_clip(path)


def overlap_of(a, b) -> float:
    """Return the frames that two stretches share, over those that either has."""
    shared = min(a.end, b.end) - max(a.start, b.start)
    return max(0, shared) / (max(a.end, b.end) - min(a.start, b.start))


def main() -> None:
    """Inject, collect evidence, fit, write."""
    clips = [c[:LONGEST_FRAMES] for c in calibration_clips(Path(sys.argv[1]))]
    matrices, overlaps = [], []
    for seed, step in enumerate(STEPS, start=11):
        slower = [c.replace(channels=c.channels[::step], fps=c.fps / step) for c in clips]
        trials = make_trials(
            slower, seed=seed, size_deg=(10.0, 90.0), length_s=(0.1, 1.0), seconds_per_fault=4.0
        )
        for trial in trials:
            native, texture = local_rotations(trial.clip), motion_texture(trial.clip)
            hypotheses = find_hypotheses(native, find_jumps(native))
            counted = [h for h in hypotheses if native.joints[h.row] in set(trial.joints)]
            consensus = find_clip_consensus(texture, ())
            matrices.append(evidence_matrix(counted, trial.clip.fps, texture, consensus))
            faults = [(native.joints.tolist().index(f.joint), f) for f in trial.faults]
            for h in counted:
                shares = [overlap_of(h, fault) for row, fault in faults if row == h.row]
                small = trial.ignored[h.start : h.end, native.joints[h.row]].any()
                overlaps.append(NEITHER if small else max(shares, default=0.0))
        print(f"{120 // step} Hz: {len(trials)} clips, {len(overlaps)} hypotheses", flush=True)
    evidence, overlap = np.concatenate(matrices), np.array(overlaps)
    kept = (overlap > WRONG) | (overlap < RIGHT)
    mean, scale = evidence[kept].mean(axis=0), evidence[kept].std(axis=0) + 1e-6
    model = LogisticRegression(C=3.0, max_iter=5000)
    model.fit((evidence[kept] - mean) / scale, overlap[kept] > WRONG)
    sure = model.predict_proba((evidence - mean) / scale)[:, 1]
    for threshold in (0.2, 0.3, 0.5, 0.7, 0.9):
        found = (sure >= threshold) & (overlap > WRONG)
        false = (sure >= threshold) & (overlap < RIGHT)
        print(
            f"at {threshold}: recall {found.sum() / (overlap > WRONG).sum():.3f}, "
            f"precision {found.sum() / (found.sum() + false.sum()):.3f}"
        )
    OUTPUT.write_text(
        json.dumps(
            {
                "features": list(FEATURES),
                "mean": np.round(mean, 5).tolist(),
                "scale": np.round(scale, 5).tolist(),
                "weights": np.round(model.coef_[0], 5).tolist(),
                "intercept": round(float(model.intercept_[0]), 5),
                "threshold": THRESHOLD,
            },
            indent=1,
        )
        + "\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
