"""What O'Kane's codec stores of a clip, in memory and as bytes."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.okane.body_and_root import BodyAndRoot, body_columns, root_columns
from mocapdb.compression.okane.pca import Components
from mocapdb.compression.payload import Reader, check_size, pack_array, pack_sparse, read_sparse
from mocapdb.compression.transforms import (
    TRANSFORMS,
    TransformName,
    coefficient_count,
    inverse_transform,
)
from mocapdb.errors import CodecError
from mocapdb.motion.representations import REPRESENTATIONS, RepresentationName
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "BYTES_PER_COEFFICIENT",
    "BYTES_PER_NUMBER",
    "OkaneClip",
    "pack_okane",
    "read_okane",
]

BYTES_PER_NUMBER = 4
BYTES_PER_COEFFICIENT = 4 + 2
_LAYOUT = struct.Struct("<BBBBI")
_NO_COMPONENTS = 0xFFFFFFFF


@dataclass(frozen=True)
class OkaneClip:
    """What is stored of a clip.

    Attributes
    ----------
    representation, transform : str
    components : Components or None
        The PCA, if there is one.
    body : (L, N)
        Coefficients of the scores, or of the poses; mostly zero.
    root : (L, r) or (F, r)
        Coefficients of the root track, or the track itself.
    root_is_exact : bool
    """

    representation: RepresentationName
    transform: TransformName
    components: Components | None
    body: FloatArray
    root: FloatArray
    root_is_exact: bool

    @property
    def counted_bytes(self) -> int:
        """Size as O'Kane counts it; an exact root track takes 8 bytes a value."""
        n_coefficients = np.count_nonzero(self.body)
        size = 0 if self.components is None else BYTES_PER_NUMBER * self.components.n_numbers
        if self.root_is_exact:
            size += 8 * self.root.size
        else:
            n_coefficients += np.count_nonzero(self.root)
        return int(size + BYTES_PER_COEFFICIENT * n_coefficients)

    def describe(self) -> str:
        """Return the choices made, such as ``"okane aligned dct pca=17"``."""
        pca = "" if self.components is None else f" pca={len(self.components)}"
        return f"okane {self.representation} {self.transform}{pca}"

    def expand(self, n_frames: int, stride: int = 1) -> BodyAndRoot:
        """Return the body and root that the numbers stand for, on every so many frames."""
        body = inverse_transform(self.transform, self.body, n_frames)[::stride]
        if self.components is not None:
            body = self.components.restore(body)
        if self.root_is_exact:
            return BodyAndRoot(body, self.root[::stride])
        return BodyAndRoot(body, inverse_transform(self.transform, self.root, n_frames)[::stride])


def pack_okane(coded: OkaneClip) -> bytes:
    """Return the body of a payload (docs/format.md, "Clip payloads")."""
    components = coded.components
    written = [
        _LAYOUT.pack(
            REPRESENTATIONS.index(coded.representation),
            TRANSFORMS.index(coded.transform),
            int(coded.root_is_exact),
            0,
            _NO_COMPONENTS if components is None else len(components),
        )
    ]
    if components is not None:
        written.append(pack_array(components.mean, np.float32))
        written.append(pack_array(components.axes, np.float32))
    if coded.root_is_exact:
        written.append(pack_array(coded.root, np.float64))
    else:
        written.append(pack_sparse(coded.root))
    written.append(pack_sparse(coded.body))
    return b"".join(written)


def read_okane(reader: Reader, skeleton: Skeleton, n_frames: int) -> OkaneClip:
    """Return what `pack_okane` wrote.

    Raises
    ------
    CodecError
        If the bytes do not fit together.
    """
    layout = reader.array(np.uint8, _LAYOUT.size, "layout").tobytes()
    representation_id, transform_id, root_form, reserved, n_components = _LAYOUT.unpack(layout)
    if (
        representation_id >= len(REPRESENTATIONS)
        or transform_id >= len(TRANSFORMS)
        or root_form > 1
        or reserved
    ):
        raise CodecError(
            "Expected a known representation, transform and root form, but got numbers "
            f"{representation_id}, {transform_id} and {root_form}. Update mocapdb to read it."
        )
    representation, transform = REPRESENTATIONS[representation_id], TRANSFORMS[transform_id]
    n_root = root_columns(skeleton, representation)
    n_body = body_columns(skeleton, representation)
    check_size(n_frames, n_body)
    components = None
    if n_components != _NO_COMPONENTS:
        if n_components > n_body:
            raise CodecError(
                f"Expected at most {n_body} principal components, but got {n_components}."
            )
        mean = reader.floats(np.float32, n_body, "mean pose")
        axes = reader.floats(np.float32, n_components * n_body, "principal axes")
        components = Components(mean, axes.reshape(n_components, n_body))
    length = coefficient_count(transform, n_frames)
    if root_form:
        root = reader.floats(np.float64, n_frames * n_root, "root track").reshape(n_frames, n_root)
    else:
        root = read_sparse(reader, length, n_root)
    body = read_sparse(reader, length, n_body if components is None else len(components))
    reader.finish()
    return OkaneClip(representation, transform, components, body, root, bool(root_form))
