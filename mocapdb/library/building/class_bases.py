"""The bases of a library's classes: what clips of a class share, learned before they are coded.

A basis is learned from some clips of a class, once, and stays: clips refer to it. It is kept in the
catalogue, so that it becomes visible in the same moment as, and never later than, its clips.

For O'Kane's codec clips without a class, and of classes of too few, are a set of their own.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from mocapdb.base.progress import Progress, silent
from mocapdb.compression.okane.okane_search import okane_representations
from mocapdb.compression.okane.set_basis import SetBasis, fit_set_basis
from mocapdb.compression.pose.class_basis import Basis, fit_basis
from mocapdb.compression.pose.smooth_channels import SmoothChannels, three_angle_joints
from mocapdb.compression.targets import Target
from mocapdb.compression.tuning import SET_PROMISE, SET_SHARE
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.library.building.plan import Task
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.tuning import LEAST_CLIPS, MOST_CLIPS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import RepresentationName
from mocapdb.motion.skeleton import Skeleton

__all__ = ["basis_for", "learn_bases", "of_class"]

ClassBases = dict[tuple[str, str], bytes]
"""Bases by label and layout of channels."""

NO_CLASS = ""
"""The label of the clips that belong to no class of enough clips."""


def learn_bases(
    catalogue: CatalogueWriter,
    tasks: Sequence[Task],
    settings: BuildSettings,
    progress: Progress = silent,
) -> ClassBases:
    """Learn the bases that a codec wants of each class and has not yet; return those of all.

    Files that cannot be read are passed over; whoever encodes them says what is wrong.
    """
    wanted = _sets(tasks, settings)
    for done, (label, own) in enumerate(wanted.items(), start=1):
        known = catalogue.class_bases()
        clips: dict[str, list[Clip]] = {}
        for task in own[:: -(-len(own) // MOST_CLIPS)]:
            clip = _read(task)
            if clip is not None:
                clips.setdefault(_layout(clip.skeleton), []).append(clip)
        for alike in clips.values():
            if len(alike) >= LEAST_CLIPS:
                for layout, basis in _fitted(alike, label, known, settings):
                    with catalogue.transaction():
                        catalogue.add_basis(basis.digest, label, layout, basis.to_bytes())
        progress(done, len(wanted), f"basis of {label or 'the clips without a class'}")
    return catalogue.class_bases()


def basis_for(
    bases: ClassBases, label: str | None, skeleton: Skeleton, settings: BuildSettings
) -> Basis | tuple[SetBasis, ...] | None:
    """Return what a codec knows of a class for a skeleton, if there is anything."""
    if settings.is_okane:
        found = [
            SetBasis.from_bytes(data)
            for name in okane_representations(settings.codec.get("representation"))
            if (data := _of_set(bases, label, _set_layout(skeleton, settings, name))) is not None
        ]
        return tuple(basis for basis in found if basis.fits(skeleton))
    data = bases.get((label or NO_CLASS, _layout(skeleton)))
    return None if data is None else Basis.from_bytes(data, skeleton)


def of_class(bases: ClassBases, label: str | None) -> ClassBases:
    """Return the bases that a clip of a class may use."""
    return {key: data for key, data in bases.items() if key[0] in {label, NO_CLASS}}


def _of_set(bases: ClassBases, label: str | None, layout: str) -> bytes | None:
    own = bases.get((label or NO_CLASS, layout))
    return bases.get((NO_CLASS, layout)) if own is None else own


def _sets(tasks: Sequence[Task], settings: BuildSettings) -> Mapping[str, list[Task]]:
    """Return the tasks of each class of enough clips, and for O'Kane's codec those of the rest."""
    by_label: dict[str, list[Task]] = {}
    for task in tasks:
        by_label.setdefault(task.label or NO_CLASS, []).append(task)
    rest = by_label.pop(NO_CLASS, [])
    rest += [task for own in by_label.values() if len(own) < LEAST_CLIPS for task in own]
    wanted = {label: own for label, own in by_label.items() if len(own) >= LEAST_CLIPS}
    if settings.is_okane and len(rest) >= LEAST_CLIPS:
        wanted[NO_CLASS] = rest
    return wanted


def _fitted(
    clips: Sequence[Clip], label: str, known: ClassBases, settings: BuildSettings
) -> Iterator[tuple[str, Basis | SetBasis]]:
    """Yield the bases of a class that are not known yet, with their layouts."""
    skeleton = clips[0].skeleton
    try:
        if not settings.is_okane:
            layout = _layout(skeleton)
            if (label, layout) not in known:
                basis = fit_basis(_in_common_orders(clips))
                if basis is not None:
                    yield layout, basis
            return
        target = settings.target if isinstance(settings.target, Target) else None
        share = _share(settings)
        for name in okane_representations(settings.codec.get("representation")):
            layout = _set_layout(skeleton, settings, name)
            if (label, layout) not in known:
                shared = fit_set_basis(clips, name, target, share)
                if shared is not None:
                    yield layout, shared
    except (ArithmeticError, ValueError, MocapdbError):  # a clip has absurdly large numbers
        return  # the clips are encoded without


def _read(task: Task) -> Clip | None:
    try:
        return read_clip(task.path, task.reading)
    except Exception:  # encoding reports what is wrong
        return None


def _layout(skeleton: Skeleton, *more: str) -> str:
    """Return what skeletons have in common whose channels mean the same."""
    content = json.dumps([skeleton.names, skeleton.dofs, skeleton.rotation_orders, *more])
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def _set_layout(skeleton: Skeleton, settings: BuildSettings, name: RepresentationName) -> str:
    """Return the layout of axes of a set: also of what they are of, and how fine they are."""
    return _layout(skeleton, name, str(settings.target), f"{_share(settings):g}")


def _share(settings: BuildSettings) -> float:
    """Return how much of the target the axes of a set may use up.

    Less where single joints are promised something: what holds that lies well below the target.
    """
    shares, target = settings.codec.get("shares"), settings.target
    promises = isinstance(target, Target) and target.share > 0
    return (SET_SHARE if shares is None else shares.pca) * (SET_PROMISE if promises else 1.0)


def _in_common_orders(clips: Sequence[Clip]) -> list[SmoothChannels]:
    """Return smooth channels of clips, every joint in the order of axes that suits most of them."""
    turning = three_angle_joints(clips[0].skeleton)
    orders = [SmoothChannels(clip).skeleton.rotation_orders for clip in clips]
    common = [Counter(own[joint] for own in orders).most_common(1)[0][0] for joint in turning]
    return [SmoothChannels(clip, common) for clip in clips]
