"""What a context is worth: faults that are found in walks, by whose motion they are compared with.

    python benchmarks/bench_context.py [FOLDER ...] [--seeds 1 2]

Faults of the kit that leave few edges, or are of several joints, are put into the walks of CMU's
subjects 02 and 07 (AMC, at most 8 s of each), on whom nothing was fitted. Each is looked for by the
clip alone and with one context after another; a clip is never its own context, on whatever rig.
FOLDER are folders of further BVH files of another corpus whose names say that they are walks.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from _corpus import corpus_or_exit

from mocapdb.cleaning.kit_scores import KitScores, kit_trials
from mocapdb.cleaning.local_rotations import Texture, motion_texture
from mocapdb.cleaning.map.detector import detect_faults
from mocapdb.cleaning.neighbours.counterpart_joints import OtherMotion, context_of
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.cleaning.tuning import TEXTURE_FPS
from mocapdb.corpus.synthetic.fault_kit import RECIPES, Recipe
from mocapdb.io import find_motion_files, read_clip, write_clip
from mocapdb.motion.clip import Clip

SEVERAL_SOFT = Recipe(
    "several joints, eased", "offset", (45, 90), (0.3, 1.2), (0.1, 0.5), "several joints"
)
ASKED = ("eased offset 45 and 90", "drift and return", "offset 10", "several joints 20")
KINDS = (SEVERAL_SOFT, *(recipe for recipe in RECIPES if recipe.name in ASKED))
OWN = {"02": ("02_01", "02_02"), "07": tuple(f"07_0{take}" for take in range(1, 7))}
ACTORS = ("03_01", "03_02", "05_01", "131_01", "131_02")
ACTORS_BVH = (
    "08_01", "08_02", "08_03", "08_04", "12_01", "16_15", "16_16", "32_01", "35_02", "35_03",
    "49_01",
)  # fmt: skip
LONGEST_S, SECONDS_PER_FAULT = 8.0, 3.0


class Walks:
    """The walks, as each context needs them."""

    def __init__(self, corpus: Path, elsewhere: Sequence[Path]) -> None:
        paths = {(path.stem, path.suffix, path.parent.name): path
                 for path in find_motion_files(corpus, [".amc", ".bvh"])}  # fmt: skip

        def amc(stem: str) -> Clip:
            return _read(paths[stem, ".amc", stem.split("_", maxsplit=1)[0]])

        def bvh(stem: str) -> Clip:
            return _read(paths[stem, ".bvh", "bvh"])

        stems = [stem for own in OWN.values() for stem in own]
        self.targets = [amc(stem) for stem in stems]
        self.textures = [motion_texture(clip) for clip in self.targets]
        self.actors = [motion_texture(amc(stem)) for stem in ACTORS]
        with tempfile.TemporaryDirectory() as folder:
            self.rewritten = [_rewritten(clip, Path(folder)) for clip in self.targets]
        self.converted = [OtherMotion.of(bvh(stem), TEXTURE_FPS) for stem in stems]
        self.actors_bvh = [OtherMotion.of(bvh(stem), TEXTURE_FPS) for stem in ACTORS_BVH]
        self.elsewhere = [
            OtherMotion.of(_read(path), TEXTURE_FPS)
            for folder in elsewhere
            for path in find_motion_files(folder, [".bvh"])
            if "walk" in path.stem
        ]

    def contexts(self, clip: Clip, name: str) -> Iterator[tuple[str, list[Vocabulary]]]:
        """Yield what a clip is compared with, by what it is; `name` is the walk that it is of."""

        def own(walks: Sequence[Texture | OtherMotion]) -> list:
            return [w for w in walks if w.name != name and w.name[:2] == name[:2]]

        actors = [w for w in self.textures if w.name[:2] != name[:2]] + self.actors
        strangers = [w for w in self.converted if w.name[:2] != name[:2]] + self.actors_bvh
        yield "the clip alone", []
        yield "same actor, same rig", [Vocabulary.of(own(self.textures))]
        yield "same actor, BVH by mocapdb", context_of(clip, own(self.rewritten))
        yield "same actor, CMU's BVH (other joints)", context_of(clip, own(self.converted))
        yield "other actors, same joints", [Vocabulary.of(actors)]
        yield "other actors, CMU's BVH", context_of(clip, strangers)
        if self.elsewhere:
            yield "another corpus", context_of(clip, self.elsewhere)


def _read(path: Path) -> Clip:
    clip = read_clip(path, drop_tpose=True)
    return clip[: round(LONGEST_S * clip.fps)]


def _rewritten(clip: Clip, folder: Path) -> OtherMotion:
    """Return a clip as the BVH that mocapdb writes of it."""
    path = folder / f"{clip.name}.bvh"
    write_clip(clip, path)
    return OtherMotion.of(read_clip(path), TEXTURE_FPS)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("elsewhere", nargs="*", type=Path)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    asked = parser.parse_args()
    walks = Walks(corpus_or_exit(), asked.elsewhere)
    scores: dict[str, KitScores] = defaultdict(KitScores)
    for seed in asked.seeds:
        for recipe in KINDS:
            trials = kit_trials(
                walks.targets, seed=seed, recipes=[recipe], seconds_per_fault=SECONDS_PER_FAULT
            )
            for name, trial in trials:
                if name != recipe.name:  # cut off
                    continue
                for how, context in walks.contexts(trial.clip, trial.original.name):
                    scores[how].add_trial(name, trial, detect_faults(trial.clip, context))
    for clip in walks.targets:
        for how, context in walks.contexts(clip, clip.name):
            scores[how].add_untouched(clip, detect_faults(clip, context))
    print(
        "\t".join(
            (
                "context",
                *(kind.name for kind in KINDS),
                "precision (spans)",
                "false alarms, body and all",
            )
        )
    )
    for how, found in scores.items():
        tallies = [found.tallies[kind.name] for kind in KINDS]
        cells = [f"{t.found} of {t.found + t.missed}" for t in tallies]
        print(
            "\t".join(
                (
                    how, *cells, f"{found.precision:.3f} ({len(found.sure)})",
                    f"{found.body_alarms}, {found.all_alarms} in {found.untouched_min:.1f} min",
                )
            )
        )  # fmt: skip


if __name__ == "__main__":
    main()
