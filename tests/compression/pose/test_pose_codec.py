"""The pose codec as a whole: what is promised of any clip, of any bytes, and to any reader."""

import hashlib
import os
import subprocess
import sys
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import spearmanr
from strategies import clips

from mocapdb.compression import Basis, PayloadReader, Target, decode, encode, fit_basis, tuning
from mocapdb.compression.payload import HEADER_BYTES
from mocapdb.compression.pose.modes import TRANSFORM_MODES
from mocapdb.compression.pose.skin_metric import point_distances
from mocapdb.compression.pose.smooth_channels import SmoothChannels
from mocapdb.compression.pose.target_search import TargetSearch
from mocapdb.corpus import synthetic
from mocapdb.errors import CodecError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skin import motion_error, pose_error

KINDS = ["skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"]
WALK = synthetic.make_clip("walk", seed=1)


def lost(clip, payload, target, **options):
    """The figure that a target bounds, measured on what the bytes decode to."""
    skeleton = clip.skeleton
    decoded = decode(payload.data, skeleton, **options)
    poses = [forward_kinematics(skeleton, channels) for channels in (clip.channels, decoded)]
    return target.measure(pose_error(skeleton, *poses, points=target.points))


# -- any clip --------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(
    clip=clips(),
    kind=st.sampled_from(KINDS),
    value=st.floats(1e-4, 1e3, allow_subnormal=False),
    transform=st.sampled_from(list(TRANSFORM_MODES)),
    decorrelation=st.sampled_from(["auto", "lattice", "none", "pca"]),
)
def test_the_target_is_held_on_any_clip(clip, kind, value, transform, decorrelation):
    target = Target(kind, value)
    payload = encode(clip, target, transform=transform, decorrelation=decorrelation)
    assert lost(clip, payload, target) <= value
    if clip.skeleton.n_joints > 1:
        restored = clip.replace(channels=decode(payload.data, clip.skeleton))
        assert motion_error(clip, restored) == payload.error


@settings(max_examples=25)
@given(clip=clips(), data=st.data())
def test_any_frames_are_those_of_the_whole(clip, data):
    payload = encode(clip, Target("mean_mm", 5.0))
    reader = PayloadReader(payload.data, clip.skeleton)
    whole = reader.channels()
    ends = st.integers(-len(clip), len(clip)) | st.none()
    part = slice(data.draw(ends), data.draw(ends), data.draw(st.sampled_from([None, 1, 3, -1])))
    np.testing.assert_array_equal(reader.channels(part), whole[part])


def test_ten_thousand_frames_are_read_block_by_block():
    clip = synthetic.make_clip("walk", seed=2)
    long = clip.replace(channels=np.tile(clip.channels, (-(-10_000 // len(clip)), 1))[:10_000])
    payload = encode(long, Target("mean_mm", 5.0), transform="spline", decorrelation="lattice")
    assert lost(long, payload, Target("mean_mm", 5.0)) <= 5.0
    asked = []

    class Watched:
        def __len__(self):
            return len(payload.data)

        def __getitem__(self, part):
            asked.append(part.indices(len(self)))
            return payload.data[part]

    reader = PayloadReader(Watched(), clip.skeleton)
    front = sum(stop - start for start, stop, _ in asked)
    asked.clear()
    part = reader.channels(slice(4000, 4001))
    np.testing.assert_array_equal(part, decode(payload.data, clip.skeleton)[4000:4001])
    assert len(asked) == 1
    assert sum(stop - start for start, stop, _ in asked) + front < len(payload.data) / 3


def with_jump(clip):
    channels = clip.channels.copy()
    channels[len(clip) // 2 :, 6] += 120.0
    return clip.replace(channels=channels)


def with_spike(clip):
    channels = clip.channels.copy()
    channels[len(clip) // 2, 20] += 60.0
    return clip.replace(channels=channels)


def turning(clip):
    channels = clip.channels.copy()
    channels[:, 4] += np.linspace(0, 3 * 360, len(clip))
    return clip.replace(channels=(channels + 180) % 360 - 180)


def flipping(clip):
    """A toe that flips to and fro: knots a little closer fit it no better."""
    channels = clip.channels.copy()
    channels[:, -1] += 40.0 * (np.random.default_rng(0).random(len(clip)) < 0.2)
    return clip.replace(channels=channels)


EDGES = {
    "one frame": WALK[:1],
    "two frames": WALK[:2],
    "three frames": WALK[:3],
    "still": WALK.replace(channels=np.tile(WALK.channels[:1], (50, 1))),
    "zero": WALK.replace(channels=np.zeros((50, WALK.skeleton.n_channels))),
    "jump": with_jump(WALK[:200]),
    "spike": with_spike(WALK[:200]),
    "turning": turning(WALK[:200]),
    "flipping": flipping(WALK[:200]),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("edge", EDGES)
def test_the_target_is_held_at_the_edges(edge, kind):
    target = Target(kind, 5.0)
    payload = encode(EDGES[edge], target)
    assert payload.codec.startswith("pose")
    assert lost(EDGES[edge], payload, target) <= 5.0


@pytest.mark.parametrize("curves", [0, 6])
def test_a_maximum_is_held_where_mending_gave_nothing(curves, monkeypatch):
    """By finer and finer steps; where no curve is fine enough, frame by frame."""
    monkeypatch.setattr(tuning, "MAXIMUM_ROUNDS", 0)
    monkeypatch.setattr(tuning, "REFINEMENT_CURVE_ROUNDS", curves)
    target = Target("max_mm", 2.0)
    payload = encode(EDGES["flipping"], target)
    assert payload.codec.startswith("pose")
    assert ("still" in payload.codec) == (curves > 0)
    assert lost(EDGES["flipping"], payload, target) <= 2.0


def test_what_does_not_fit_the_integers_is_kept_as_it_is():
    far = WALK[:20].channels.copy()
    far[:, 0] += 1e32
    payload = encode(WALK[:20].replace(channels=far), Target("mean_mm", 1.0))
    assert payload.codec == "raw"


def test_a_mean_comes_near_its_target():
    for value in (0.2, 2.0, 20.0):
        target = Target("mean_mm", value)
        assert 0.9 * value < lost(WALK, encode(WALK, target), target) <= value


def test_a_spike_is_cheaper_than_a_curve_that_follows_it():
    target = Target("mean_mm", 2.0)
    clip = WALK[:200]
    sizes = [len(encode(each, target).data) for each in (clip, with_spike(clip))]
    assert sizes[1] < 1.1 * sizes[0] + 20


# -- choices ---------------------------------------------------------------------------------------


def test_every_choice_can_be_named_and_is_described():
    clip, target = WALK, Target("mean_mm", 2.0)
    for transform in ("spline", "dct32", "dct64", "dct", "dwt"):
        assert transform in encode(clip, target, transform=transform).codec
    assert encode(clip, target, decorrelation="pca").codec.startswith("pose pca ")
    lattice, alone = (
        len(encode(clip, target, decorrelation=name).data) for name in ("lattice", "none")
    )
    assert lattice < 0.9 * alone


def test_points_that_are_far_off_weigh_less_where_distances_are_averaged():
    for kind, is_reweighed in (("mean_mm", True), ("shell_mean_mm", True), ("skinned", False)):
        made = TargetSearch(WALK, Target(kind, 2.0), TRANSFORM_MODES["spline"])
        usual = made.points
        coded = made.run()
        if not is_reweighed:
            assert made.points is usual
            continue
        changes = made.points.weights / usual.weights
        assert (changes[~usual.is_measured] == 1.0).all()
        pose = forward_kinematics(made.smooth.skeleton, made.smooth.values())
        values = np.concatenate([block.values() for block in coded.blocks])
        other = forward_kinematics(made.smooth.skeleton, values)
        misses = point_distances(usual, pose, other).mean(axis=0)
        assert (misses[~usual.is_measured] == 0.0).all()
        measured = usual.is_measured
        assert spearmanr(changes[measured], misses[measured]).statistic < -0.5


def class_basis(seeds=(3, 4, 5)):
    made = [synthetic.make_clip("walk", seed=seed) for seed in seeds]
    orders = [made[0].skeleton.rotation_orders[joint] for joint in range(made[0].skeleton.n_joints)]
    common = [order for order in orders if len(order) == 3]
    return fit_basis([SmoothChannels(clip, common) for clip in made])


def test_a_basis_of_a_class_is_referred_to():
    basis, target = class_basis(), Target("mean_mm", 2.0)
    payload = encode(WALK, target, decorrelation="class", basis=basis)
    assert payload.codec.startswith("pose class ")
    bases = {basis.digest: basis.to_bytes()}
    assert lost(WALK, payload, target, bases=bases) <= 2.0
    with pytest.raises(CodecError, match=f"basis {basis.digest.hex()} that the clip refers to"):
        decode(payload.data, WALK.skeleton)


def test_auto_takes_the_basis_only_where_it_is_smaller():
    basis, target = class_basis(), Target("mean_mm", 2.0)
    sizes = {
        name: len(encode(WALK, target, decorrelation=name, basis=basis).data)
        for name in ("auto", "lattice", "class")
    }
    assert sizes["auto"] == min(sizes.values())


def test_coordinates_in_a_basis_are_inverse_and_bytes_come_back():
    basis = class_basis()
    values = SmoothChannels(WALK, basis.orders).values()
    np.testing.assert_allclose(basis.expand(basis.coordinates(values)), values, atol=1e-6)
    again = Basis.from_bytes(basis.to_bytes(), WALK.skeleton)
    np.testing.assert_array_equal(again.matrix, basis.matrix)
    assert again.orders == basis.orders
    assert again.digest == basis.digest


def test_a_basis_gathers_the_motion_in_few_directions():
    basis = class_basis()
    values = SmoothChannels(WALK, basis.orders).values()
    spread = basis.coordinates(values)[:, 6:].var(axis=0)
    assert spread[:12].sum() > 0.95 * spread.sum()


@pytest.mark.parametrize("data", [b"", b"nonsense", zlib.compress(b"\0" * 100)])
def test_bytes_that_are_no_basis_are_refused(data):
    with pytest.raises(CodecError, match="Expected a basis"):
        Basis.from_bytes(data, WALK.skeleton)


def test_a_basis_cannot_blow_up():
    bomb = zlib.compress(bytes(50_000_000))
    with pytest.raises(CodecError, match="Expected a basis"):
        Basis.from_bytes(bomb, WALK.skeleton)


# -- any bytes -------------------------------------------------------------------------------------

SHORT = WALK[:90]
PAYLOADS = [
    encode(SHORT, Target("mean_mm", 3.0)).data,
    encode(SHORT, Target("max_mm", 3.0), transform="dct32").data,
    encode(SHORT, Target("mean_mm", 10.0), transform="dwt", decorrelation="pca").data,
]


@settings(max_examples=150)
@given(data=st.data(), payload=st.sampled_from(PAYLOADS))
def test_a_flipped_bit_is_noticed(data, payload):
    damaged = bytearray(payload)
    damaged[data.draw(st.integers(0, len(payload) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    with pytest.raises(CodecError):
        decode(bytes(damaged), SHORT.skeleton)


@given(data=st.data(), payload=st.sampled_from(PAYLOADS), extra=st.binary(max_size=9))
def test_cuts_and_extensions_are_noticed(data, payload, extra):
    cut = payload[: data.draw(st.integers(0, len(payload) - 1))]
    with pytest.raises(CodecError):
        decode(cut + extra, SHORT.skeleton)
    with pytest.raises(CodecError):
        decode(payload + extra + b"\0", SHORT.skeleton)


def forged(payload):
    """The bytes with checksums that fit, for one block: damage that only the decoder can notice."""
    size, shift, at = 0, 0, HEADER_BYTES
    while True:
        size |= (payload[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if payload[at - 1] < 0x80:
            break
    block = payload[at + size : -4]
    check = zlib.crc32(block, zlib.crc32(payload[: at + size]))
    return payload[:-4] + check.to_bytes(4, "little")


@settings(max_examples=300)
@given(data=st.data(), payload=st.sampled_from(PAYLOADS))
def test_damage_under_fitting_checksums_is_refused_or_decodes_to_finite_channels(data, payload):
    damaged = bytearray(payload)
    places = st.integers(HEADER_BYTES + 2, len(payload) - 5)
    for at in data.draw(st.lists(places | st.integers(22, 60), min_size=1, max_size=8)):
        damaged[at] = data.draw(st.integers(0, 255))
    try:
        channels = decode(forged(bytes(damaged)), SHORT.skeleton)
    except CodecError:
        return
    assert channels.shape == SHORT.channels.shape
    assert np.isfinite(channels).all()


@settings(max_examples=150)
@given(noise=st.binary(min_size=1, max_size=400), payload=st.sampled_from(PAYLOADS))
def test_noise_for_a_block_ends(noise, payload):
    """Whatever is in a block, decoding it ends, in finite numbers or in a refusal."""
    start = payload[: len(payload) // 3]
    damaged = (start + noise * (len(payload) // len(noise) + 1))[: len(payload)]
    try:
        channels = decode(forged(damaged), SHORT.skeleton)
    except CodecError:
        return
    assert np.isfinite(channels).all()


@pytest.mark.parametrize("n_frames", [0, 91, 2**31, 2**32 - 1])
def test_a_false_number_of_frames_is_refused_before_anything_is_allocated(n_frames):
    damaged = bytearray(PAYLOADS[0])
    damaged[8:12] = n_frames.to_bytes(4, "little")
    with pytest.raises(CodecError):
        decode(bytes(damaged), SHORT.skeleton)


# -- any reader ------------------------------------------------------------------------------------

SCRIPT = """
import hashlib, sys
from mocapdb.compression import Target, decode, encode
from mocapdb.corpus import synthetic
clip = synthetic.make_clip("walk", seed=1)[:150]
data = encode(clip, Target("mean_mm", 2.0)).data
sys.stdout.write(hashlib.sha256(data).hexdigest() + " ")
sys.stdout.write(hashlib.sha256(decode(data, clip.skeleton).tobytes()).hexdigest())
"""


@pytest.mark.parametrize("threads", ["1", "2"])
def test_other_processes_and_numbers_of_threads_agree(threads):
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    answer = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=os.environ | dict.fromkeys(names, threads),
        capture_output=True,
        text=True,
        check=True,
    )
    clip = WALK[:150]
    data = encode(clip, Target("mean_mm", 2.0)).data
    digests = [
        hashlib.sha256(part).hexdigest() for part in (data, decode(data, clip.skeleton).tobytes())
    ]
    assert answer.stdout.split() == digests


def lever_clip():
    """A small clip whose values are exact in binary, so that its bytes are the same anywhere."""
    from mocapdb.motion.skeleton import Skeleton

    skeleton = Skeleton(
        ["root", "arm", "hand"],
        [-1, 0, 1],
        [[0, 0, 0], [1, 0, 0], [1, 0, 0]],
        [["tx", "ry"], ["rz"], ["rz"]],
        ["Y", "Z", "Z"],
        convention="acclaim",
    )
    ramp = np.arange(64.0)[:, None]
    return Clip(
        skeleton, np.hstack([ramp / 8, 2 * ramp, 45 - ramp / 2, np.full_like(ramp, 30.0)]), 64.0
    )


OLD_PAYLOADS = {
    # what earlier versions wrote: never to be made anew
    "okane": (
        "4d43445001010400400000009a967c4821414bdd00000000ffffffff13000c000000010003000500"
        "070009000b000d000f00110013001500170019001b001d001f002100230000000100030005000700"
        "09000b000d000f001100130015000000fc41cab692c1b74e02c0c2563bbf70b1bebe16f365be6848"
        "19be095bdabd7ffda2bd9aee7bbdb0f647bdee1222bd959405bd4c30dfbc9c82bcbce8a3a0bc19de"
        "89bcc9f66dbc38374ebceab23541d391d3c017e93bbf931387beb57e09bec7cca5bdd00a5dbdbc70"
        "1dbd720aebbc5fa6b5bce32d90bc30b869bc040001000000010003000500000000006a43cab69242"
        "b74e0241c2563b4000007043ca552840"
    ),
    "pose": (
        "4d43445002020400400000009a967c4821414bdd080100401606a2a2157a6fe45468da48e86796d5"
        "c1009e31ca4b7161fc23bd4de04c6e"
    ),
}


@pytest.mark.parametrize("codec", OLD_PAYLOADS)
def test_payloads_of_earlier_versions_still_open(codec):
    clip = lever_clip()
    channels = decode(bytes.fromhex(OLD_PAYLOADS[codec]), clip.skeleton)
    error = motion_error(clip, clip.replace(channels=channels))
    assert error.vertices.mean <= 5.0


# -- real clips ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "kind", "value"),
    [
        ("cmu/asfamc/02/02_03.amc", "mean_mm", 1.0),
        ("cmu/asfamc/07/07_01.amc", "shell_max_mm", 1.4),
        ("cmu/bvh/35_28.bvh", "max_mm", 10.0),
        ("hdm05/cut/HDM_bd_squat1Reps_003_120.amc", "skinned", 0.5),
    ],
)
def test_the_target_is_held_on_real_clips_at_a_tenth_of_their_size(corpus, path, kind, value):
    clip = read_clip(corpus / path)[1:400]
    target = Target(kind, value)
    payload = encode(clip, target)
    assert lost(clip, payload, target) <= value
    assert len(payload.data) < 0.1 * 4 * clip.channels.size


def test_plain_python_decodes_the_same(monkeypatch):
    from mocapdb.base import kernels

    encoded = encode(WALK[:40], Target("max_mm", 5.0)).data
    compiled = decode(encoded, WALK.skeleton)
    monkeypatch.setattr(kernels._Compiled, "__call__", lambda self, *args: self.function(*args))
    np.testing.assert_allclose(decode(encoded, WALK.skeleton), compiled, rtol=0, atol=1e-9)
