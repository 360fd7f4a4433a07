"""What O'Kane's codec stores of a clip, in memory and as bytes."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.okane.body_and_root import BodyAndRoot, body_columns, root_columns
from mocapdb.compression.okane.pca import Components
from mocapdb.compression.okane.set_basis import SET_DIGEST_BYTES, SetBasis
from mocapdb.compression.payload import Reader, check_size, pack_array, pack_sparse, read_sparse
from mocapdb.compression.transforms import (
    TRANSFORMS,
    WAVELET,
    TransformName,
    check_wavelet,
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
_NAMED_WAVELET = len(TRANSFORMS)  # the transform is a DWT whose wavelet's name follows


@dataclass(frozen=True)
class OkaneClip:
    """What is stored of a clip.

    Attributes
    ----------
    representation, transform, wavelet : str
    components : Components or None
        The PCA, if there is one.
    basis : bytes or None
        The digest of the set's axes that the components are the first of; None where the clip
        brings its own.
    body : (L, N)
        Coefficients of the scores, or of the poses; mostly zero.
    root : (L, r) or (F, r)
        Coefficients of the root track, or the track itself.
    root_is_exact : bool
    threshold : float
        What every coefficient of the body reached, as it was weighed; it is not stored.
    """

    representation: RepresentationName
    transform: TransformName
    wavelet: str
    components: Components | None
    basis: bytes | None
    body: FloatArray
    root: FloatArray
    root_is_exact: bool
    threshold: float = 0.0

    @property
    def counted_bytes(self) -> int:
        """Size as O'Kane counts it; an exact root track takes 8 bytes a value.

        Axes that a set shares are not the clip's.
        """
        n_coefficients = np.count_nonzero(self.body)
        size = 0
        if self.components is not None and self.basis is None:
            size = BYTES_PER_NUMBER * self.components.n_numbers
        if self.root_is_exact:
            size += 8 * self.root.size
        else:
            n_coefficients += np.count_nonzero(self.root)
        return int(size + BYTES_PER_COEFFICIENT * n_coefficients)

    def describe(self) -> str:
        """Return the choices made, such as ``"okane aligned dwt db4 pca=17 of a set"``."""
        named = self.transform == "dwt" and self.wavelet != WAVELET
        wavelet = f" {self.wavelet}" if named else ""
        pca = "" if self.components is None else f" pca={len(self.components)}"
        shared = "" if self.basis is None else " of a set"
        return f"okane {self.representation} {self.transform}{wavelet}{pca}{shared}"

    def expand(self, n_frames: int, stride: int = 1) -> BodyAndRoot:
        """Return the body and root that the numbers stand for, on every so many frames."""
        body = inverse_transform(self.transform, self.body, n_frames, self.wavelet)[::stride]
        if self.components is not None:
            body = self.components.restore(body)
        if self.root_is_exact:
            return BodyAndRoot(body, self.root[::stride])
        track = inverse_transform(self.transform, self.root, n_frames, self.wavelet)
        return BodyAndRoot(body, track[::stride])


def pack_okane(coded: OkaneClip) -> bytes:
    """Return the body of a payload (docs/format.md, "Clip payloads")."""
    components = coded.components
    is_named = coded.transform == "dwt" and coded.wavelet != WAVELET
    written = [
        _LAYOUT.pack(
            REPRESENTATIONS.index(coded.representation),
            _NAMED_WAVELET if is_named else TRANSFORMS.index(coded.transform),
            int(coded.root_is_exact),
            int(coded.basis is not None),
            _NO_COMPONENTS if components is None else len(components),
        )
    ]
    if is_named:
        written.append(bytes([len(coded.wavelet)]) + coded.wavelet.encode("ascii"))
    if coded.basis is not None:
        written.append(coded.basis)
    elif components is not None:
        written.append(pack_array(components.mean, np.float32))
        written.append(pack_array(components.axes, np.float32))
    if coded.root_is_exact:
        written.append(pack_array(coded.root, np.float64))
    else:
        written.append(pack_sparse(coded.root))
    written.append(pack_sparse(coded.body))
    return b"".join(written)


def read_okane(
    reader: Reader, skeleton: Skeleton, n_frames: int, bases: Mapping[bytes, bytes]
) -> OkaneClip:
    """Return what `pack_okane` wrote.

    Parameters
    ----------
    reader, skeleton, n_frames
    bases : mapping of bytes to bytes
        The axes of sets, by their digests.

    Raises
    ------
    CodecError
        If the bytes do not fit together, or refer to axes that are not among the bases.
    """
    layout = reader.array(np.uint8, _LAYOUT.size, "layout").tobytes()
    representation_id, transform_id, root_form, basis_form, n_components = _LAYOUT.unpack(layout)
    if (
        representation_id >= len(REPRESENTATIONS)
        or transform_id > _NAMED_WAVELET
        or root_form > 1
        or basis_form > 1
    ):
        raise CodecError(
            "Expected a known representation, transform, root form and basis form, but got numbers "
            f"{representation_id}, {transform_id}, {root_form} and {basis_form}. Update mocapdb to "
            "read it."
        )
    representation = REPRESENTATIONS[representation_id]
    wavelet, transform = WAVELET, TRANSFORMS[min(transform_id, _NAMED_WAVELET - 1)]
    if transform_id == _NAMED_WAVELET:
        wavelet, transform = _read_wavelet(reader), "dwt"
    n_root = root_columns(skeleton, representation)
    n_body = body_columns(skeleton, representation)
    check_size(n_frames, n_body)
    components, digest = None, None
    if n_components != _NO_COMPONENTS and n_components > n_body:
        raise CodecError(f"Expected at most {n_body} principal components, but got {n_components}.")
    if basis_form:
        digest = reader.array(np.uint8, SET_DIGEST_BYTES, "digest of a basis").tobytes()
        components = _shared_components(digest, bases, representation, n_components, skeleton)
    elif n_components != _NO_COMPONENTS:
        mean = reader.floats(np.float32, n_body, "mean pose")
        axes = reader.floats(np.float32, n_components * n_body, "principal axes")
        components = Components(mean, axes.reshape(n_components, n_body))
    length = coefficient_count(transform, n_frames, wavelet)
    if root_form:
        root = reader.floats(np.float64, n_frames * n_root, "root track").reshape(n_frames, n_root)
    else:
        root = read_sparse(reader, length, n_root)
    body = read_sparse(reader, length, n_body if components is None else len(components))
    reader.finish()
    return OkaneClip(
        representation, transform, wavelet, components, digest, body, root, bool(root_form)
    )


def _read_wavelet(reader: Reader) -> str:
    """Return the name of the wavelet that a payload was made with."""
    (length,) = reader.array(np.uint8, 1, "length of a wavelet's name").tolist()
    name = reader.array(np.uint8, length, "wavelet's name").tobytes().decode("ascii", "replace")
    check_wavelet(name)
    return name


def _shared_components(
    digest: bytes,
    bases: Mapping[bytes, bytes],
    representation: RepresentationName,
    count: int,
    skeleton: Skeleton,
) -> Components:
    """Return the first components of the set's axes that a payload refers to."""
    if digest not in bases:
        raise CodecError(
            f"Expected the axes {digest.hex()} that this clip shares with others, but they are not "
            "at hand. Decode it through its library."
        )
    basis = SetBasis.from_bytes(bases[digest])
    fits = basis.representation == representation and basis.fits(skeleton)
    if not fits or count > len(basis.components):
        raise CodecError(
            f"Expected {count} axes of {representation} under {digest.hex()}, but those at hand "
            f"are {len(basis.components)} of {basis.representation}."
        )
    return basis.components.first(count)
