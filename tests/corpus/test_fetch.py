from __future__ import annotations

import email.utils
import hashlib
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from scripted_server import (
    MONDAY,
    MOTION,
    PAGE,
    SKELETON,
    TUESDAY,
    Answer,
    Handler,
    Server,
    broken_off,
    entry,
    part,
    running_server,
    stalled,
    status,
    whole,
)

from mocapdb.corpus.fetch import FetchProgress, FetchReport, Policy, fetch, plan
from mocapdb.corpus.manifest import ManifestEntry
from mocapdb.errors import CorpusError

QUICK = Policy(min_interval_s=0.0, retries=3, timeout_s=60.0, backoff_s=0.0)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    with running_server() as server:
        yield server


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


class Sleeper:
    """Stands in for sleep and clock: time passes only by sleeping."""

    def __init__(self) -> None:
        self.slept: list[float] = []

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)

    def clock(self) -> float:
        return sum(self.slept)


def run(
    server: Server, directory: Path, *answers: Answer, sha256: str | None = None
) -> FetchReport:
    """Fetch clip 02_01, whose motion file the server answers with `answers`."""
    server.script["/02/02_01.amc"] = list(answers)
    return fetch([entry(server, sha256=sha256)], directory, policy=QUICK, sleep=lambda _: None)


def reason(report: FetchReport) -> str:
    (failure,) = report.failed
    return failure.reason


def motion_file(directory: Path) -> Path:
    return directory / "02" / "02_01.amc"


def partial_file(directory: Path) -> Path:
    return directory / "02" / "02_01.amc.partial"


class TestWhole:
    def test_motion_and_skeleton_lie_side_by_side(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path / "new" / "cmu", whole(MOTION), sha256=digest(MOTION))
        folder = tmp_path / "new" / "cmu" / "02"
        assert sorted(path.name for path in folder.iterdir()) == ["02.asf", "02_01.amc"]
        assert (folder / "02_01.amc").read_bytes() == MOTION
        assert (folder / "02.asf").read_bytes() == SKELETON
        assert [item.path for item in report.done] == [folder / "02.asf", folder / "02_01.amc"]
        assert report.failed == []
        assert report.bytes_received == len(MOTION) + len(SKELETON)

    def test_skeleton_is_asked_for_once(self, server: Server, tmp_path: Path) -> None:
        for clip in ("02_01", "02_02", "02_03"):
            server.script[f"/02/{clip}.amc"] = [whole(MOTION)]
        entries = [entry(server, clip) for clip in ("02_01", "02_02", "02_03")]
        report = fetch(entries, tmp_path, policy=QUICK)
        assert len(report.done) == 4
        assert len(server.asked_for("/02/02.asf")) == 1

    def test_user_agent_says_who_asks(self, server: Server, tmp_path: Path) -> None:
        run(server, tmp_path, whole(MOTION))
        for _, headers in server.requests:
            assert headers["User-Agent"].startswith("mocapdb/")
            assert headers["Accept-Encoding"] == "identity"

    def test_second_fetch_asks_for_nothing(self, server: Server, tmp_path: Path) -> None:
        run(server, tmp_path, whole(MOTION), sha256=digest(MOTION))
        server.requests.clear()
        report = run(server, tmp_path, whole(MOTION), sha256=digest(MOTION))
        assert (len(report.skipped), report.done, report.failed) == (2, [], [])
        assert server.requests == []

    @pytest.mark.parametrize("before", [b"", MOTION[:-1], b"something else"])
    def test_wrong_file_is_replaced(self, server: Server, tmp_path: Path, before: bytes) -> None:
        motion_file(tmp_path).parent.mkdir()
        motion_file(tmp_path).write_bytes(before)
        run(server, tmp_path, whole(MOTION), sha256=digest(MOTION))
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_file_of_unknown_checksum_is_left_alone(self, server: Server, tmp_path: Path) -> None:
        motion_file(tmp_path).parent.mkdir()
        motion_file(tmp_path).write_bytes(b"edited by hand")
        run(server, tmp_path, whole(MOTION))
        assert motion_file(tmp_path).read_bytes() == b"edited by hand"

    def test_empty_file_does_not_count(self, server: Server, tmp_path: Path) -> None:
        motion_file(tmp_path).parent.mkdir()
        motion_file(tmp_path).touch()
        run(server, tmp_path, whole(MOTION))
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_body_without_length(self, server: Server, tmp_path: Path) -> None:
        def answer(handler: Handler) -> None:
            handler.answer(200, {"Connection": "close"}, MOTION)

        assert run(server, tmp_path, answer).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_redirect_is_followed(self, server: Server, tmp_path: Path) -> None:
        server.script["/moved.amc"] = [whole(MOTION)]
        assert run(server, tmp_path, status(301, Location="/moved.amc")).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_redirect_to_another_host_is_refused(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path, status(302, Location="http://elsewhere.invalid/a.amc"))
        assert "was sent elsewhere" in reason(report)
        assert not motion_file(tmp_path).exists()

    @pytest.mark.parametrize("is_told", [True, False])
    def test_a_body_without_end_is_given_up(
        self, server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_told: bool
    ) -> None:
        monkeypatch.setattr("mocapdb.corpus._transfer.MOST_BYTES", 1000)

        def answer(handler: Handler) -> None:
            told = {"Content-Length": str(len(MOTION))}
            handler.answer(200, told if is_told else {"Connection": "close"}, MOTION)

        assert "No clip is so large" in reason(run(server, tmp_path, answer))
        assert not motion_file(tmp_path).exists()

    def test_progress_counts_files_and_bytes(self, server: Server, tmp_path: Path) -> None:
        server.script["/02/02_01.amc"] = [whole(MOTION)]
        states: list[FetchProgress] = []
        fetch([entry(server)], tmp_path, policy=QUICK, progress=states.append)
        assert {(state.n_done, state.n_files) for state in states} == {(0, 2), (1, 2)}
        assert states[0].bytes_done == 0
        assert (states[-1].bytes_done, states[-1].bytes_total) == (len(MOTION), len(MOTION))
        assert states[-1].download.clips == ("02_01",)


class TestResume:
    def test_goes_on_where_the_connection_broke(self, server: Server, tmp_path: Path) -> None:
        report = run(
            server, tmp_path, broken_off(MOTION, 30_000), part(MOTION), sha256=digest(MOTION)
        )
        assert report.failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION
        first, second = server.asked_for("/02/02_01.amc")
        assert "Range" not in first
        assert (second["Range"], second["If-Range"]) == ("bytes=30000-", MONDAY)
        assert report.bytes_received == len(MOTION) + len(SKELETON)  # nothing came twice

    def test_goes_on_in_a_later_run(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path, broken_off(MOTION, 30_000))
        assert "4 attempts" in reason(report)
        assert not motion_file(tmp_path).exists()
        server.requests.clear()
        assert run(server, tmp_path, part(MOTION)).failed == []
        (request,) = server.asked_for("/02/02_01.amc")
        assert request["Range"] == "bytes=30000-"
        assert motion_file(tmp_path).read_bytes() == MOTION
        assert not partial_file(tmp_path).exists()

    def test_starts_again_where_ranges_are_ignored(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path, broken_off(MOTION, 30_000), whole(MOTION))
        assert report.failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    @pytest.mark.parametrize("heed_if_range", [True, False])
    def test_versions_are_not_joined(
        self, server: Server, tmp_path: Path, heed_if_range: bool
    ) -> None:
        newer = part(MOTION.upper(), TUESDAY, heed_if_range=heed_if_range)
        assert run(server, tmp_path, broken_off(MOTION, 30_000), newer).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION.upper()

    def test_partial_of_a_killed_process_is_not_trusted(
        self, server: Server, tmp_path: Path
    ) -> None:
        partial_file(tmp_path).parent.mkdir()
        partial_file(tmp_path).write_bytes(b"X" * 100)  # modified now, not on Monday
        assert run(server, tmp_path, part(MOTION)).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_server_without_versions_is_asked_for_the_whole(
        self, server: Server, tmp_path: Path
    ) -> None:
        def break_off(handler: Handler) -> None:
            handler.answer(200, {"Content-Length": len(MOTION)}, MOTION[:30_000])
            handler.hang_up()

        def rest(handler: Handler) -> None:
            if "Range" not in handler.headers:
                handler.answer(200, {"Content-Length": len(MOTION)}, MOTION)
                return
            content_range = f"bytes 30000-{len(MOTION) - 1}/{len(MOTION)}"
            headers = {"Content-Range": content_range, "Content-Length": len(MOTION) - 30_000}
            handler.answer(206, headers, MOTION[30_000:])

        assert run(server, tmp_path, break_off, rest).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    @pytest.mark.parametrize("content_range", ["bytes 5-9/100", "bytes */100", "nonsense", ""])
    def test_another_part_than_asked_for(
        self, server: Server, tmp_path: Path, content_range: str
    ) -> None:
        def other_part(handler: Handler) -> None:
            headers = {"Content-Range": content_range, "Content-Length": 5, "Last-Modified": MONDAY}
            handler.answer(206, headers, b"XXXXX")

        report = run(server, tmp_path, broken_off(MOTION, 30_000), other_part, part(MOTION))
        assert report.failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_server_that_gives_a_piece_at_a_time(self, server: Server, tmp_path: Path) -> None:
        def piece(handler: Handler) -> None:
            start = int(handler.headers["Range"].removeprefix("bytes=").removesuffix("-"))
            body = MOTION[start : start + 20_000]
            headers = {
                "Content-Range": f"bytes {start}-{start + len(body) - 1}/{len(MOTION)}",
                "Content-Length": len(body),
                "Last-Modified": MONDAY,
            }
            handler.answer(206, headers, body)

        begun = broken_off(MOTION, len(MOTION) - 30_000)
        assert run(server, tmp_path, begun, piece).failed == []
        assert len(server.asked_for("/02/02_01.amc")) == 3
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_partial_that_was_whole_already(self, server: Server, tmp_path: Path) -> None:
        run(server, tmp_path, broken_off(MOTION + b"\n", len(MOTION)))
        assert partial_file(tmp_path).read_bytes() == MOTION
        assert run(server, tmp_path, part(MOTION)).failed == []  # 416, then from the start
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_stop_by_the_user_leaves_only_what_can_be_resumed(
        self, server: Server, tmp_path: Path
    ) -> None:
        server.script["/02/02_01.amc"] = [whole(MOTION)]

        def stop(state: FetchProgress) -> None:
            if state.download.path.suffix == ".amc" and state.bytes_done:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            fetch([entry(server)], tmp_path, policy=QUICK, progress=stop)
        assert not motion_file(tmp_path).exists()
        assert MOTION.startswith(partial_file(tmp_path).read_bytes())
        assert partial_file(tmp_path).stat().st_mtime == (
            email.utils.parsedate_to_datetime(MONDAY).timestamp()
        )


class TestChecks:
    def assert_nothing_kept(self, directory: Path) -> None:
        assert [path.name for path in (directory / "02").iterdir()] == ["02.asf"]

    def test_corrupt_bytes(self, server: Server, tmp_path: Path) -> None:
        corrupt = MOTION[:500] + b"9" + MOTION[501:]
        report = run(server, tmp_path, whole(corrupt), sha256=digest(MOTION))
        text = reason(report)
        assert text.startswith(f"{server.url}/02/02_01.amc: Expected SHA-256 {digest(MOTION)}")
        assert digest(corrupt) in text
        self.assert_nothing_kept(tmp_path)

    def test_corrupt_bytes_do_not_replace_what_is_there(
        self, server: Server, tmp_path: Path
    ) -> None:
        motion_file(tmp_path).parent.mkdir()
        motion_file(tmp_path).write_bytes(b"older")
        run(server, tmp_path, whole(b"corrupt"), sha256=digest(MOTION))
        assert motion_file(tmp_path).read_bytes() == b"older"

    @pytest.mark.parametrize(
        ("body", "what"),
        [
            (PAGE, "web page"),
            (b"\xef\xbb\xbf<?xml version='1.0'?>", "web page"),
            (b"PK\x03\x04\x00\x00\x00", "binary"),
            (b"", "empty"),
            (b" \r\n", "empty"),
        ],
    )
    def test_what_is_no_motion_data(
        self, server: Server, tmp_path: Path, body: bytes, what: str
    ) -> None:
        report = run(server, tmp_path, whole(body))
        assert what in reason(report)
        self.assert_nothing_kept(tmp_path)

    def test_length_greater_than_the_body(self, server: Server, tmp_path: Path) -> None:
        def answer(handler: Handler) -> None:
            handler.answer(200, {"Content-Length": len(MOTION) + 10}, MOTION)
            handler.hang_up()

        report = run(server, tmp_path, answer)
        assert "The connection broke" in reason(report)
        assert not motion_file(tmp_path).exists()

    def test_length_smaller_than_the_body_is_caught_by_the_checksum(
        self, server: Server, tmp_path: Path
    ) -> None:
        def answer(handler: Handler) -> None:
            handler.answer(200, {"Content-Length": 1000}, MOTION)
            handler.hang_up()

        assert "SHA-256" in reason(run(server, tmp_path, answer, sha256=digest(MOTION)))
        self.assert_nothing_kept(tmp_path)

    def test_encoded_body_is_refused(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path, whole(MOTION, **{"Content-Encoding": "gzip"}))
        assert "gzip" in reason(report)
        self.assert_nothing_kept(tmp_path)


class TestRetries:
    @pytest.mark.parametrize("code", [404, 403, 410, 400])
    def test_refusal_is_final(self, server: Server, tmp_path: Path, code: int) -> None:
        report = run(server, tmp_path, status(code))
        assert f"{server.url}/02/02_01.amc: The server answered {code} " in reason(report)
        assert len(server.asked_for("/02/02_01.amc")) == 1

    @pytest.mark.parametrize("code", [408, 429, 500, 502, 503])
    def test_trouble_that_passes(self, server: Server, tmp_path: Path, code: int) -> None:
        assert run(server, tmp_path, status(code), status(code), whole(MOTION)).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_trouble_that_stays(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path, status(503))
        assert "answered 503 Service Unavailable. That was the last of 4" in reason(report)
        assert len(server.asked_for("/02/02_01.amc")) == 4

    def test_connection_that_breaks_before_an_answer(self, server: Server, tmp_path: Path) -> None:
        assert run(server, tmp_path, Handler.hang_up, whole(MOTION)).failed == []

    def test_stall_is_given_up_and_resumed(self, server: Server, tmp_path: Path) -> None:
        server.script["/02/02_01.amc"] = [stalled(MOTION, 30_000), part(MOTION)]
        policy = Policy(min_interval_s=0.0, retries=1, timeout_s=1.0, backoff_s=0.0)
        assert fetch([entry(server)], tmp_path, policy=policy).failed == []
        assert motion_file(tmp_path).read_bytes() == MOTION

    def test_trickle_is_given_up(self, server: Server, tmp_path: Path) -> None:
        def trickle(handler: Handler) -> None:
            handler.answer(200, {"Content-Length": len(MOTION), "Last-Modified": MONDAY}, b"")
            for start in range(100):
                handler.wfile.write(MOTION[start : start + 1])
                handler.wfile.flush()
                time.sleep(0.05)

        server.script["/02/02_01.amc"] = [trickle]
        policy = Policy(min_interval_s=0.0, retries=0, timeout_s=1.0, backoff_s=0.0)
        report = fetch([entry(server)], tmp_path, policy=policy)
        assert "Got only" in reason(report)
        assert 0 < partial_file(tmp_path).stat().st_size < 100

    def test_waits_grow(self, server: Server, tmp_path: Path) -> None:
        server.script["/02/02_01.amc"] = [status(503)]
        sleeper = Sleeper()
        policy = Policy(min_interval_s=0.0, retries=4, backoff_s=1.0)
        fetch([entry(server)], tmp_path, policy=policy, sleep=sleeper.sleep, clock=sleeper.clock)
        assert len(sleeper.slept) == 4
        for attempt, seconds in enumerate(sleeper.slept):
            assert 0.5 * 2**attempt <= seconds <= 2**attempt

    @pytest.mark.parametrize("as_date", [False, True])
    def test_retry_after_is_honoured(self, server: Server, tmp_path: Path, as_date: bool) -> None:
        later = email.utils.formatdate(time.time() + 100, usegmt=True) if as_date else 100
        server.script["/02/02_01.amc"] = [status(429, Retry_After=later), whole(MOTION)]
        sleeper = Sleeper()
        report = fetch(
            [entry(server)],
            tmp_path,
            policy=Policy(min_interval_s=0.0),
            sleep=sleeper.sleep,
            clock=sleeper.clock,
        )
        assert report.failed == []
        assert sleeper.slept == [pytest.approx(100, abs=15)]

    @pytest.mark.parametrize("text", ["soon", "-5", "Mon, 99 Foo 2009"])
    def test_retry_after_that_makes_no_sense(
        self, server: Server, tmp_path: Path, text: str
    ) -> None:
        assert run(server, tmp_path, status(503, Retry_After=text), whole(MOTION)).failed == []

    def test_retry_after_hours_is_a_refusal(self, server: Server, tmp_path: Path) -> None:
        report = run(server, tmp_path, status(429, Retry_After=7200))
        assert "come back in 7200 s" in reason(report)
        assert len(server.asked_for("/02/02_01.amc")) == 1

    def test_requests_keep_their_distance(self, server: Server, tmp_path: Path) -> None:
        server.script["/02/02_01.amc"] = [whole(MOTION)]
        server.script["/02/02_02.amc"] = [whole(MOTION)]
        sleeper = Sleeper()
        fetch(
            [entry(server), entry(server, "02_02")],
            tmp_path,
            policy=Policy(min_interval_s=0.5),
            sleep=sleeper.sleep,
            clock=sleeper.clock,
        )
        assert sleeper.slept == [0.5, 0.5]  # three requests


class TestSeveral:
    def test_one_bad_clip_does_not_stop_the_rest(self, server: Server, tmp_path: Path) -> None:
        server.script["/02/02_01.amc"] = [status(404)]
        server.script["/02/02_02.amc"] = [whole(PAGE)]
        server.script["/02/02_03.amc"] = [whole(MOTION)]
        entries = [entry(server, clip) for clip in ("02_01", "02_02", "02_03")]
        report = fetch(entries, tmp_path, policy=QUICK)
        assert [failure.download.clips for failure in report.failed] == [("02_01",), ("02_02",)]
        assert [item.path.name for item in report.done] == ["02.asf", "02_03.amc"]

    def test_missing_skeleton_names_the_clips_it_is_for(
        self, server: Server, tmp_path: Path
    ) -> None:
        server.script["/07/07_01.amc"] = server.script["/07/07_02.amc"] = [whole(MOTION)]
        report = fetch(
            [entry(server, "07_01"), entry(server, "07_02")], tmp_path, policy=QUICK
        ).to_dict()
        (failed,) = report["failed"]
        assert failed["clips"] == ["07_01", "07_02"]
        assert "404" in failed["reason"]

    def test_dead_server_is_not_asked_a_thousand_times(
        self, server: Server, tmp_path: Path
    ) -> None:
        clips = [f"02_{trial:02d}" for trial in range(1, 11)]
        server.script = {f"/02/{clip}.amc": [status(503)] for clip in clips}
        server.script["/02/02.asf"] = [whole(SKELETON)]
        report = fetch(
            [entry(server, clip) for clip in clips],
            tmp_path,
            policy=QUICK,
            sleep=lambda _: None,
        )
        assert len(report.failed) == 10
        assert "Not tried" in report.failed[-1].reason
        assert len(server.requests) == 1 + 3 * 4

    def test_server_that_comes_back_is_asked_on(self, server: Server, tmp_path: Path) -> None:
        clips = [f"02_{trial:02d}" for trial in range(1, 7)]
        for clip in clips:
            works = clip in {"02_03", "02_06"}
            server.script[f"/02/{clip}.amc"] = [whole(MOTION) if works else status(503)]
        report = fetch(
            [entry(server, clip) for clip in clips],
            tmp_path,
            policy=QUICK,
            sleep=lambda _: None,
        )
        assert [item.path.name for item in report.done] == ["02.asf", "02_03.amc", "02_06.amc"]

    def test_refusals_do_not_count_as_a_dead_server(self, server: Server, tmp_path: Path) -> None:
        clips = [f"02_{trial:02d}" for trial in range(1, 8)]
        server.script["/02/02_07.amc"] = [whole(MOTION)]
        report = fetch([entry(server, clip) for clip in clips], tmp_path, policy=QUICK)
        assert len(report.failed) == 6
        assert (tmp_path / "02" / "02_07.amc").exists()

    def test_nobody_listens(self, tmp_path: Path, server: Server) -> None:
        wanted = entry(server)
        server.server_close()
        report = fetch([wanted], tmp_path, policy=QUICK, sleep=lambda _: None)
        assert len(report.failed) == 2
        assert "The connection broke" in report.failed[0].reason


class TestPlan:
    def test_says_what_is_missing_without_asking(self, server: Server, tmp_path: Path) -> None:
        (tmp_path / "02").mkdir()
        (tmp_path / "02" / "02.asf").write_bytes(SKELETON)
        todo = plan([entry(server), entry(server, "02_02")], tmp_path)
        assert [item.path.name for item in todo.missing] == ["02_01.amc", "02_02.amc"]
        assert [item.clips for item in todo.present] == [("02_01", "02_02")]
        assert todo.to_dict()["skipped"] == [str(tmp_path / "02" / "02.asf")]
        assert server.requests == []
        assert sorted(path.name for path in tmp_path.rglob("*.*")) == ["02.asf"]

    def test_skeleton_comes_first(self, server: Server, tmp_path: Path) -> None:
        todo = plan([entry(server, "07_01"), entry(server)], tmp_path)
        names = [item.path.name for item in todo.missing]
        assert names == ["07.asf", "07_01.amc", "02.asf", "02_01.amc"]

    def test_two_sources_for_one_file(self, server: Server, tmp_path: Path) -> None:
        other = ManifestEntry(
            "02_02",
            "02",
            "02",
            "walk",
            "",
            120.0,
            "http://elsewhere/02.asf",
            "http://elsewhere/02_02.amc",
        )
        with pytest.raises(CorpusError, match=r"one source for .*02\.asf"):
            plan([entry(server), other], tmp_path)


class TestDisk:
    def test_target_that_cannot_be_written(self, server: Server, tmp_path: Path) -> None:
        (tmp_path / "cmu").write_text("a file, not a folder")
        with pytest.raises(CorpusError, match="Expected to read and write here"):
            run(server, tmp_path / "cmu", whole(MOTION))

    def test_full_disk(
        self, server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def full(descriptor: int) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("os.fsync", full)
        with pytest.raises(CorpusError, match="No space left on device"):
            run(server, tmp_path, whole(MOTION))
        assert not motion_file(tmp_path).exists()
