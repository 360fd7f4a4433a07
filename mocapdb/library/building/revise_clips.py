"""Cleaned revisions of a library's clips: searched, repaired and encoded beside what was captured.

A clip as it was captured stays as it is. Its revision is made of the clip's file, if that is there
and has not changed, else of the decoded clip, and encoded like it. The payload is written first;
the row that makes it part of the library comes last, in one transaction.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.base.progress import Progress, silent
from mocapdb.base.workers import on_workers
from mocapdb.errors import MocapdbError
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import SHARDS_FOLDER
from mocapdb.library.library import Library
from mocapdb.library.naming import file_and_take
from mocapdb.library.revision import Revision, revision_digest
from mocapdb.library.shard_entries import revision_entry
from mocapdb.library.tuning import COMMIT_BYTES, COMMIT_SECONDS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.pack_shards import Stored, packed_shard
from mocapdb.motion.clip import Clip

if TYPE_CHECKING:
    from mocapdb.cleaning import Span, Vocabulary
    from mocapdb.cleaning.repair.repair import Repair
    from mocapdb.library.building.class_bases import ClassBases
    from mocapdb.library.searching.canonical_shards import PackedMotion
    from mocapdb.library.stored_clip import StoredClip

__all__ = ["CleaningReport", "CleaningSettings", "captured_clip", "revise_clips", "span_rows"]

Context: TypeAlias = "Callable[[Clip], Sequence[Vocabulary]]"


@dataclass(frozen=True)
class CleaningSettings:
    """How clips are searched and repaired; see `detect_faults` and `repair_spans`.

    Attributes
    ----------
    threshold : float, optional
        Confidence from which a span is flagged; by default the calibrated one.
    hold_feet, two_stage : bool
    context : tuple of str
        What similar motion was looked for in, besides the clip.
    """

    threshold: float | None = None
    hold_feet: bool = True
    two_stage: bool = False
    context: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, as they come back from JSON."""
        return asdict(self) | {"context": list(self.context)}


@dataclass
class CleaningReport:
    """What came of cleaning a library.

    Attributes
    ----------
    searched, skipped : int
        Clips that were searched, and those that were in the same way already.
    cleaned : list of str
        Clips in which something was repaired.
    spans, repaired : int
        Flagged in the clips that were searched, and repaired of these.
    left : dict of str to int
        Spans that are flagged and are as they were, by clip: nothing was good enough.
    cut : list of str
        Clips with frames at an end that were not searched, such as a T-pose in front.
    failed : dict of str to str
        Clips that cannot be searched, and why.
    stale_cycles : list of str
        Classes whose kept cycle was made of clips as they were before.
    """

    searched: int = 0
    skipped: int = 0
    cleaned: list[str] = field(default_factory=list)
    spans: int = 0
    repaired: int = 0
    left: dict[str, int] = field(default_factory=dict)
    cut: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    stale_cycles: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists, ready for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Revised:
    """What a worker returns of a clip: what was flagged, and the repaired clip if there is one."""

    spans: list[dict[str, Any]]
    threshold: float
    made_of: str
    data: bytes = b""
    columns: dict[str, Any] = field(default_factory=dict)
    features: tuple[PackedMotion | None, str | None] | None = None
    is_cut: bool = False


NO_PAYLOAD = {
    "codec": "",
    "payload_bytes": 0,
    "skinned_error": 0.0,
    "error_mean_mm": 0.0,
    "error_p95_mm": 0.0,
    "error_max_mm": 0.0,
}


def revise_clips(
    library: Library,
    catalogue: CatalogueWriter,
    settings: CleaningSettings | None = None,
    *,
    names: Sequence[str] | None = None,
    context: Context | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> CleaningReport:
    """Search clips for faults and keep what is repaired; only the only writer may.

    Clips that this version has searched in the same way are skipped. A clip that cannot be
    searched is named in the report and passed over.

    Parameters
    ----------
    library : Library
        The same as the catalogue's.
    catalogue : CatalogueWriter
    settings : CleaningSettings, optional
    names : sequence of str, optional
        Only these clips; all by default.
    context : callable, optional
        Returns what a clip is compared with besides itself. Then this process does the work alone,
        or workers of a cluster, each of which has it for itself.
    jobs : int, optional
        Worker processes; as many as there are processors by default.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work and see the same files.
    progress : callable, optional
    """
    settings = settings or CleaningSettings()
    report = CleaningReport()
    records = library.records() if names is None else [library.record(name) for name in names]
    before = catalogue.revisions()
    wanted = [r for r in records if not _is_done(before.get(r.id), settings)]
    report.skipped = len(records) - len(wanted)
    committer = _Committer(catalogue, settings, report, before)
    with closing(
        _answers(library, catalogue, wanted, settings, context, jobs, scheduler)
    ) as answers:
        try:
            for done, (record, answer) in enumerate(zip(wanted, answers, strict=True), start=1):
                if isinstance(answer, str):
                    report.failed[record.name] = answer
                else:
                    committer.add(record, answer)
                progress(done, len(wanted), record.name)
        finally:  # what is done is kept, also where Ctrl-C ends it
            committer.commit()
    return report


def _is_done(revision: Revision | None, settings: CleaningSettings) -> bool:
    """Tell whether a clip was searched in the same way by the same version."""
    from mocapdb import __version__

    if revision is None or revision.version != __version__:
        return False
    return {key: revision.settings.get(key) for key in settings.to_dict()} == settings.to_dict()


def _answers(
    library: Library,
    catalogue: CatalogueWriter,
    records: Sequence[ClipRecord],
    settings: CleaningSettings,
    context: Context | None,
    jobs: int | None,
    scheduler: str | None,
) -> Generator[Revised | str]:
    """Yield what came of each clip, or what is wrong with it, in their order."""
    from mocapdb.library.building.class_bases import of_class

    indexed = catalogue.is_indexed()
    bases = catalogue.class_bases()
    orders: list[tuple[Any, ...]] = [
        (_stored(library, record), settings, of_class(bases, record.label), indexed)
        for record in records
    ]
    if context is not None:
        orders = [(*order, context) for order in orders]
        if scheduler is None:  # each process would read it again
            jobs = 1
    seen = [order[0].shard for order in orders[:1] if not isinstance(order[0], str)]
    seen += [path for record in records[:1] if (path := _source_path(record)).is_file()]
    return on_workers(_revise, orders, jobs=jobs, scheduler=scheduler, seen=seen)


def _stored(library: Library, record: ClipRecord) -> StoredClip | str:
    """Return a clip for a worker, or what is wrong with its rows."""
    try:
        return library.stored(record, record)
    except MocapdbError as problem:
        return str(problem)


def _revise(
    stored: StoredClip | str,
    settings: CleaningSettings,
    bases: ClassBases,
    index: bool,
    context: Context | None = None,
) -> Revised | str:
    """Search, repair and encode one clip, or say what is wrong with it; runs in a worker."""
    if isinstance(stored, str):
        return stored
    record = stored.record
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # refused, rather than warned of
            source = _source(stored)
            clip = stored.decode() if source is None else source
            made_of = "decoded" if source is None else "source"
            vocabularies = context(clip) if context else ()
            return _revised(clip, made_of, vocabularies, settings, record.settings, bases, index)
    except Exception as problem:  # whatever one clip does, the others are cleaned
        return _reason(problem)


def captured_clip(stored: StoredClip) -> Clip:
    """Return a clip as its file holds it, if the file is there and is still the same; else decoded.

    What compression has left of small joints looks like faults now and then: the file does not.
    What was cleaned is decoded.
    """
    source = _source(stored) if stored.row is stored.record else None
    return stored.decode() if source is None else source


def _source_path(record: ClipRecord) -> Path:
    return Path(record.corpus, file_and_take(record.source)[0])


def _source(stored: StoredClip) -> Clip | None:
    """Return a clip as its file holds it, if the file is there and is still the same."""
    from mocapdb.io import read_clip
    from mocapdb.io.reading import ReadOptions
    from mocapdb.io.tpose import without_tpose
    from mocapdb.library.building.plan import Failure, hash_file
    from mocapdb.library.building.settings import reading_of
    from mocapdb.library.stored_clip import clip_of_row

    record, kept = stored.record, stored.skeleton
    path = _source_path(record)
    said = reading_of(record.settings)
    known = hash_file(path, said.skeleton)
    if isinstance(known, Failure) or known[0] != record.source_sha256:
        return None
    turned = said.up not in (None, "y", "z")
    up: Any = said.up if turned else record.up
    take = file_and_take(record.source)[1] or None
    found = ReadOptions(record.unit_m, up, record.fps, known[1], said.joint_map, take=take)
    try:
        clip = read_clip(path, found)
        if BuildSettings.from_json(record.settings).drop_tpose:
            clip = without_tpose(clip)
    except MocapdbError:
        return None
    if clip.skeleton.digest != kept.digest or len(clip) != record.frames:
        return None
    return clip_of_row(record, None, kept, clip.channels)


def _revised(
    clip: Clip,
    made_of: str,
    vocabularies: Sequence[Vocabulary],
    settings: CleaningSettings,
    encoding: str,
    bases: ClassBases,
    index: bool,
) -> Revised:
    from mocapdb.cleaning import detect_faults, repair_spans
    from mocapdb.library.building.encode_files import encode_clip
    from mocapdb.library.searching.canonical_shards import packed_features

    found = detect_faults(
        clip, vocabularies, threshold=settings.threshold, two_stage=settings.two_stage
    )
    repaired, repairs = repair_spans(clip, found, hold_feet=settings.hold_feet)
    spans = span_rows(clip, repaired, repairs)
    features = packed_features(repaired) if index else None
    if not any(span["repaired"] for span in spans):
        return Revised(
            spans, found.threshold, made_of, features=features, is_cut=bool(found.cut_off)
        )
    payload = encode_clip(repaired, clip.label, BuildSettings.from_json(encoding), bases)
    vertices = payload.error.vertices
    columns = {
        "codec": payload.codec,
        "payload_bytes": len(payload.data),
        "skinned_error": payload.error.skinned,
        "error_mean_mm": vertices.mean,
        "error_p95_mm": vertices.p95,
        "error_max_mm": vertices.max,
    }
    return Revised(spans, found.threshold, made_of, payload.data, columns, features,
                   bool(found.cut_off))  # fmt: skip


def _reason(problem: Exception) -> str:
    from mocapdb.library.building.plan import what_happened

    return str(problem) if isinstance(problem, MocapdbError) else what_happened(problem)


class _Committer:
    """Gathers revisions and commits them, a shard and a transaction at a time."""

    def __init__(
        self,
        catalogue: CatalogueWriter,
        settings: CleaningSettings,
        report: CleaningReport,
        before: Mapping[int, Revision],
    ) -> None:
        self._catalogue = catalogue
        self._settings = settings
        self._report = report
        self._before = before
        self._kept_cycles = kept_cycles(catalogue)
        self._waiting: list[tuple[ClipRecord, Revised]] = []
        self._since = time.monotonic()

    def add(self, record: ClipRecord, revised: Revised) -> None:
        """Take a revision, and commit if enough has come together."""
        self._waiting.append((record, revised))
        size = sum(len(waiting.data) for _, waiting in self._waiting)
        if size >= COMMIT_BYTES or time.monotonic() - self._since >= COMMIT_SECONDS:
            self.commit()

    def commit(self) -> None:
        """Write the waiting revisions as one shard and make them visible, all or none."""
        from mocapdb import __version__

        self._since = time.monotonic()
        if not self._waiting:
            return
        catalogue, waiting = self._catalogue, self._waiting
        kind, now = "cleaned", datetime.now(UTC).isoformat(timespec="seconds")
        digests = [revision_digest(r.source_sha256, kind, each.spans) for r, each in waiting]
        with_payload = [i for i, (_, each) in enumerate(waiting) if each.data]
        with catalogue.transaction():
            catalogue.drop_revisions([record.id for record, _ in waiting], now)
            rows = []
            for i, (record, each) in enumerate(waiting):
                settings = self._settings.to_dict() | {
                    "used_threshold": each.threshold,
                    "made_of": each.made_of,
                }
                own = {
                    "clip_id": record.id,
                    "kind": kind,
                    "created": now,
                    "version": __version__,
                    "settings": json.dumps(settings, sort_keys=True),
                    "spans": json.dumps(each.spans, sort_keys=True),
                    "sha256": digests[i],
                    "shard_id": None,
                    "shard_row": None,
                }
                rows.append(NO_PAYLOAD | each.columns | own)
            stored = [self._stored(waiting[i], rows[i]) for i in with_payload]
            if stored:
                shard_id = catalogue.add_shard(SHARDS_FOLDER, packed_shard(catalogue, stored))
                for place, i in enumerate(with_payload):
                    rows[i] |= {"shard_id": shard_id, "shard_row": place}
            for row in rows:
                catalogue.insert("revisions", row)
            self._commit_features(waiting)
        self._waiting = []
        self._note(waiting)

    def _stored(self, revised: tuple[ClipRecord, Revised], row: dict[str, Any]) -> Stored:
        """Return the payload of a revision as a shard holds it."""
        record, each = revised
        clip = self._catalogue.row("clips", record.id)
        skeleton = self._catalogue.skeleton(record.skeleton_id)
        entry = revision_entry(row, clip, skeleton.digest)
        return Stored(each.data, row["sha256"], entry, skeleton)

    def _commit_features(self, waiting: Sequence[tuple[ClipRecord, Revised]]) -> None:
        """Put the features of clips that are other than before in place of what there was."""
        from mocapdb.library.searching.canonical_shards import commit_features

        changed = [
            (record.id, *each.features)
            for record, each in waiting
            if each.features is not None and self._has_changed(record, each)
        ]
        if changed:
            commit_features(self._catalogue, changed)

    def _has_changed(self, record: ClipRecord, each: Revised) -> bool:
        """Tell whether what is decoded of a clip is another than before."""
        earlier = self._before.get(record.id)
        return bool(each.data) or (earlier is not None and earlier.changes)

    def _note(self, waiting: Sequence[tuple[ClipRecord, Revised]]) -> None:
        report = self._report
        stale = set(report.stale_cycles)
        for record, each in waiting:
            n_left = sum(not span["repaired"] for span in each.spans)
            report.searched += 1
            report.spans += len(each.spans)
            report.repaired += len(each.spans) - n_left
            if each.data:
                report.cleaned.append(record.name)
            if n_left:
                report.left[record.name] = n_left
            if each.is_cut:
                report.cut.append(record.name)
            if record.label in self._kept_cycles and (n_left or self._has_changed(record, each)):
                stale.add(str(record.label))
        report.stale_cycles = sorted(stale)


def kept_cycles(catalogue: CatalogueWriter) -> set[str]:
    """Return the classes of which a library keeps the cycle."""
    from mocapdb.library.cycles_file import list_cycles

    return {str(row["class"]) for row in list_cycles(catalogue.path.parent)}


def span_rows(before: Clip, after: Clip, repairs: Sequence[Repair]) -> list[dict[str, Any]]:
    """Return what was flagged and what was done about it, a row a span, ready for JSON.

    ``moved_deg`` is the mean angle by which the joint was turned over the span, ``moved_mm`` the
    mean distance by which its own translation, or the ball of the foot, was moved,
    ``expected_deg`` the mean error of the method on gaps of the same length elsewhere in the joint;
    None where there is none.
    """
    from mocapdb.cleaning.local_rotations import local_rotations
    from mocapdb.motion.quaternions import angles_deg

    skeleton = before.skeleton
    old, new = local_rotations(before), local_rotations(after)
    rows = {joint: row for row, joint in enumerate(old.joints.tolist())}
    told = []
    for repair in repairs:
        span = repair.span
        turned = moved = None
        if repair.repaired and span.joint in rows:
            row = rows[span.joint]
            turns = angles_deg(old.quat_xyzw[span.frames, row], new.quat_xyzw[span.frames, row])
            turned = float(turns.mean())
        shifted = _moved_mm(before, after, span.joint, span.frames)
        if repair.repaired and shifted is not None and shifted.any():
            moved = float(shifted.mean())
        elif repair.method == "held":
            moved = _foot_moved_mm(before, after, span)
        expected = float(repair.expected_deg)
        told.append(
            {
                "joint": skeleton.names[span.joint],
                "start": span.start / before.fps,
                "end": span.end / before.fps,
                "frames": [span.start, span.end],
                "confidence": round(span.confidence, 4),
                "kind": span.kind,
                "repaired": repair.repaired,
                "method": repair.method,
                "moved_deg": None if turned is None else round(turned, 2),
                "moved_mm": None if moved is None else round(moved, 2),
                "expected_deg": round(expected, 2) if np.isfinite(expected) else None,
                "contact_mm": round(repair.contact_mm, 1) if repair.has_contact else None,
            }
        )
    return told


def _foot_moved_mm(before: Clip, after: Clip, span: Span) -> float:
    """Return the mean distance by which the ball of a foot was moved in a span."""
    from mocapdb.cleaning.evidence.foot_faults import foot_paths

    legs, old = foot_paths(before)
    new = foot_paths(after)[1]
    i = next(i for i, leg in enumerate(legs) if leg.foot == span.joint)
    apart = old[i][span.frames, 0] - new[i][span.frames, 0]
    return float(np.linalg.norm(apart, axis=1).mean()) * 1000.0


def _moved_mm(before: Clip, after: Clip, joint: int, frames: slice) -> FloatArray | None:
    """Return by how much a joint's translation channels differ, frame by frame."""
    skeleton = before.skeleton
    first = int(skeleton.channel_starts[joint])
    columns = [first + i for i, dof in enumerate(skeleton.dofs[joint]) if dof[0] == "t"]
    if not columns:
        return None
    apart = after.channels[frames][:, columns] - before.channels[frames][:, columns]
    return np.asarray(np.linalg.norm(apart, axis=1) * skeleton.metres_per_unit * 1000.0)
