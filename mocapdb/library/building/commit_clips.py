"""What workers have encoded comes into the library: a shard and a transaction at a time."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mocapdb.library.building.assumptions import Assumptions
from mocapdb.library.building.encode_files import Encoded
from mocapdb.library.building.plan import Failure
from mocapdb.library.building.revise_clips import CleaningReport
from mocapdb.library.building.settings import BuildSettings
from mocapdb.library.joint_losses import unpack_losses
from mocapdb.library.layout import SHARDS_FOLDER
from mocapdb.library.naming import source_of, stem_of
from mocapdb.library.shard_entries import clip_entry
from mocapdb.library.tuning import COMMIT_BYTES, COMMIT_SECONDS, LOSSES_SHOWN
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.pack_shards import Stored, packed_shard

__all__ = ["BuildReport", "Committer"]


@dataclass
class BuildReport:
    """What a build did.

    Attributes
    ----------
    library : str
        Path of the library.
    built, skipped : int
        Clips encoded by this build, and clips that were there already.
    hashed : int
        Files that were read to know whether they have changed; the others look as they did.
    failed : list of Failure
    unheld : list of str
        Clips stored as they are, since their codec keeps them to the target in no fewer bytes.
    frames, payload_bytes : int
        Of the clips that this build encoded.
    seconds : float
    dropped_revisions : list of str
        Clips whose file or settings have changed: what was cleaned was of the clip before.
    cleaned : CleaningReport, optional
        What came of cleaning, where the build was told to.
    held_still : list of str
        Clips with joints that move and hardly do so any more, and the first of these.
    not_learned : int
        Labelled clips that the classes do not know yet, since they are too few to matter.
    joined : int
        Small files of the library that were joined into fewer.
    not_joined : str
        Why others could not be; empty where nothing was in the way.
    assumed : Assumptions, optional
        What was taken for granted of the corpus's clips, also of those that were there already.
    """

    library: str
    built: int = 0
    skipped: int = 0
    hashed: int = 0
    failed: list[Failure] = field(default_factory=list)
    unheld: list[str] = field(default_factory=list)
    frames: int = 0
    payload_bytes: int = 0
    seconds: float = 0.0
    dropped_revisions: list[str] = field(default_factory=list)
    cleaned: CleaningReport | None = None
    held_still: list[str] = field(default_factory=list)
    not_learned: int = 0
    joined: int = 0
    not_joined: str = ""
    assumed: Assumptions | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists, ready for JSON."""
        told = self.assumed
        counts = {
            "mended": len(told.mended) if told else 0,
            "unsearchable": len(told.unsearchable) if told else 0,
        }
        return asdict(self) | counts


class Committer:
    """Gathers encoded clips and commits them, a shard and a transaction at a time.

    Leaving the block commits what is left, also when it is left by an error or by Ctrl-C: what
    the workers have finished is kept.
    """

    def __init__(
        self, catalogue: CatalogueWriter, root: Path, settings: BuildSettings, report: BuildReport
    ) -> None:
        self._catalogue = catalogue
        self._corpus = str(root.resolve())
        self._settings = settings.to_json()
        self._is_raw = settings.codec.get("codec") == "raw"
        self._report = report
        self._waiting: list[Encoded] = []
        self._since = time.monotonic()
        self._started = _now()
        self._build_id: int | None = None

    def add(self, clip: Encoded) -> None:
        """Take a clip, and commit if enough has come together."""
        self._waiting.append(clip)
        size = sum(len(waiting.data) for waiting in self._waiting)
        if size >= COMMIT_BYTES or time.monotonic() - self._since >= COMMIT_SECONDS:
            self.commit()

    def reject(self, failure: Failure, strict: bool) -> None:
        """Note a bad file; with `strict`, end the build with its error."""
        self._report.failed.append(failure)
        if strict:
            raise failure.to_error()

    def commit(self) -> None:
        """Write the waiting clips as one shard and make them visible, all or none."""
        self._since = time.monotonic()
        if not self._waiting:
            return
        catalogue, waiting = self._catalogue, self._waiting
        shared = {"corpus": self._corpus, "settings": self._settings}
        with catalogue.transaction():
            deleted = {"deleted": _now()}
            replaced = [clip.task.replaces for clip in waiting if clip.task.replaces is not None]
            before = {row: catalogue.row("clips", row) for row in replaced}
            for row in before.values():
                row["file"] = catalogue.shard_file(row["shard_id"])
            revised = {row for row in replaced if catalogue.revision(row) is not None}
            catalogue.drop_revisions(replaced, deleted["deleted"])
            catalogue.update_clips(dict.fromkeys(replaced, deleted))
            rows = [self._row(clip) for clip in waiting]
            stored = [
                Stored(clip.data, clip.task.sha256, _entry(clip, row, before), clip.skeleton)
                for clip, row in zip(waiting, rows, strict=True)
            ]
            shard_id = catalogue.add_shard(SHARDS_FOLDER, packed_shard(catalogue, stored))
            build_id = self._build_id
            if build_id is None:
                build_id = catalogue.insert("builds", shared | {"started": self._started})
            indexed = []
            for place, (clip, row) in enumerate(zip(waiting, rows, strict=True)):
                own = {
                    "skeleton_id": catalogue.add_skeleton(clip.skeleton),
                    "shard_id": shard_id,
                    "shard_row": place,
                    "build_id": build_id,
                }
                clip_id = catalogue.insert("clips", row | own)
                catalogue.add_joint_errors(clip_id, clip.joint_errors)
                catalogue.keep_seen({clip_id: (clip.task.state, clip.task.bones)})
                if clip.features or clip.unmapped:
                    indexed.append((clip_id, clip.features, clip.unmapped))
            if indexed:
                from mocapdb.library.searching.canonical_shards import commit_features

                commit_features(catalogue, indexed)
            self._waiting = []
            self._build_id = build_id
            self._report.dropped_revisions += [
                clip.task.name for clip in waiting if clip.task.replaces in revised
            ]
            self._report.held_still += [line for clip in waiting if (line := _held_still(clip))]
        self._report.built += len(waiting)
        if not self._is_raw:
            as_they_are = [clip for clip in waiting if clip.columns["codec"] == "raw"]
            self._report.unheld += [
                clip.task.name for clip in as_they_are if len(clip.skeleton.bone_joints)
            ]
        self._report.frames += sum(clip.columns["frames"] for clip in waiting)
        self._report.payload_bytes += sum(len(clip.data) for clip in waiting)

    def _row(self, clip: Encoded) -> dict[str, Any]:
        """Return what the catalogue says of a clip, but for where it is."""
        task = clip.task
        return clip.columns | {
            "name": task.name,
            "stem": stem_of(source_of(task.relative, task.take)),
            "label": task.label,
            "label_source": "corpus",
            "description": task.description,
            "subject": task.subject,
            "subject_source": task.subject_source,
            "columns": json.dumps(dict(task.columns)),
            "corpus": self._corpus,
            "source": source_of(task.relative, task.take),
            "source_sha256": task.sha256,
            "settings": task.settings,
        }

    def __enter__(self) -> Committer:
        return self

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        self.commit()
        if self._build_id is not None and error is None:
            with self._catalogue.transaction():
                self._catalogue.finish_build(self._build_id, _now())


def _entry(clip: Encoded, row: dict[str, Any], before: dict[int, dict[str, Any]]) -> bytes:
    """Return what the shard says of a clip, and of the clip that it replaces."""
    replaced = before.get(clip.task.replaces) if clip.task.replaces is not None else None
    told = replaced and {key: replaced[key] for key in ("file", "shard_row", "source_sha256")}
    return clip_entry(row, clip.skeleton.digest, clip.joint_errors, told)


def _held_still(clip: Encoded) -> str:
    """Return a clip's name and joints that are held still; nothing where there are none."""
    losses = unpack_losses(clip.joint_errors, clip.skeleton.names)
    still = [str(loss) for loss in losses if loss.is_held_still]
    more = len(still) - LOSSES_SHOWN
    if more > 0:  # `info` shows all
        still = [*still[:LOSSES_SHOWN], f"and {more} more"]
    return f"{clip.task.name}: {', '.join(still)}" if still else ""


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
