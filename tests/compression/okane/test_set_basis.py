"""Axes that clips of a set share."""

import numpy as np
import pytest

from mocapdb.compression import Budgets, SetBasis, Target, decode, encode, fit_set_basis
from mocapdb.corpus import synthetic
from mocapdb.errors import CodecError
from mocapdb.motion.skin import motion_error

TARGET = Target("mean_mm", 2.0, joint_share=0)
WALKS = [synthetic.make_clip("walk", seed=seed, duration_s=1.0) for seed in range(4)]


@pytest.fixture(scope="module", params=["channels", "positions", "aligned"])
def basis(request):
    return fit_set_basis(WALKS, request.param, TARGET, 0.4)


def test_bytes_bring_the_axes_back(basis):
    again = SetBasis.from_bytes(basis.to_bytes())
    assert again.representation == basis.representation
    np.testing.assert_array_equal(again.components.axes, basis.components.axes)
    assert again.digest == basis.digest


def test_clips_refer_to_the_axes_and_need_them(basis):
    clip = WALKS[2]
    payload = encode(clip, TARGET, basis=basis, representation=basis.representation)
    assert payload.codec.endswith(f"pca={len(basis.components)} of a set")
    bases = {basis.digest: basis.to_bytes()}
    channels = decode(payload.data, clip.skeleton, bases=bases)
    error = motion_error(clip, clip.replace(channels=channels))
    assert error == payload.error
    assert TARGET.holds(error)
    with pytest.raises(CodecError, match=r"axes .* that this clip shares with others"):
        decode(payload.data, clip.skeleton)
    other = fit_set_basis(WALKS, "scaled", TARGET, 0.4)
    with pytest.raises(CodecError, match="but those at hand are"):
        decode(payload.data, clip.skeleton, bases={basis.digest: other.to_bytes()})


def test_shared_axes_are_not_paid_by_the_clip(basis):
    asked = {"representation": basis.representation, "transform": "dct"}
    own = encode(WALKS[2], TARGET, decorrelation="pca", **asked)
    shared = encode(WALKS[2], TARGET, basis=basis, **asked)
    assert shared.counted_bytes < own.counted_bytes
    if basis.representation == "aligned":  # he recommends it; the track of the root is apart
        assert len(shared.data) < 0.5 * len(own.data)


def test_axes_that_leave_too_much_are_not_used():
    still = WALKS[0].replace(channels=np.tile(WALKS[0].channels[:1], (50, 1)))
    basis = fit_set_basis([still] * 3, "aligned", TARGET, 0.4)
    assert len(basis.components) <= 1
    payload = encode(WALKS[1], TARGET, basis=basis)
    assert payload.codec.startswith("okane aligned")
    assert "of a set" not in payload.codec


def test_a_finer_target_takes_more_axes():
    counts = [
        len(
            fit_set_basis(WALKS, "aligned", Target("mean_mm", value, joint_share=0), 0.4).components
        )
        for value in (10.0, 1.0, 0.1)
    ]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


def test_clips_with_nothing_in_common_have_no_axes():
    other = synthetic.make_clip("walk", seed=1, skeleton=synthetic.make_skeleton(1.5))
    assert fit_set_basis([WALKS[0], other], "aligned", TARGET, 0.4) is not None
    far = WALKS[0].replace(channels=WALKS[0].channels + 1e35)
    assert fit_set_basis([far], "positions", TARGET, 0.4) is None


@pytest.mark.parametrize("data", [b"", b"\x02\x01\x00\x00\x00abc", b"\x09" + bytes(20)])
def test_bytes_that_are_none_are_refused(data):
    with pytest.raises(CodecError, match="axes of a set of clips"):
        SetBasis.from_bytes(data)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"decorrelation": "class"}, "a basis of the clip's class"),
        ({"decorrelation": "none", "shares": Budgets(0.2, 0.3, 0.5)}, "a budget of 0 for the PCA"),
        ({"decorrelation": "pca", "shares": Budgets(0.4, 0.0, 0.6)}, "a budget over 0 for the PCA"),
        ({"decorrelation": "lattice"}, "a decorrelation out of auto, class, pca, none"),
        ({"wavelet": "daubechies4"}, "Did you mean db4"),
        ({"wavelet": "db4", "transform": "dct"}, "no wavelet for a DCT"),
    ],
)
def test_options_that_do_not_fit_together_are_refused(options, said):
    with pytest.raises(CodecError, match=said):
        encode(WALKS[0], TARGET, codec="okane", **options)
