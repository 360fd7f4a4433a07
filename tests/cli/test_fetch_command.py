from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from scripted_server import MOTION, SKELETON, Server, entry, running_server, whole

from mocapdb.cli.fetch import fetch as fetch_command
from mocapdb.corpus.manifest import MANIFEST_COLUMNS, ManifestEntry
from mocapdb.errors import CorpusError


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    with running_server() as server:
        yield server


def write_manifest(path: Path, *entries: ManifestEntry) -> str:
    rows = [
        (e.clip, e.subject, e.trial, e.label, "", "120", e.skeleton_url, e.motion_url, "", "")
        for e in entries
    ]
    path.write_text("\n".join(",".join(row) for row in (MANIFEST_COLUMNS, *rows)) + "\n")
    return str(path)


class TestCommand:
    def invoke(self, *args: str) -> tuple[int, str, str]:
        result = CliRunner().invoke(fetch_command, args)
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.stdout, result.stderr

    def test_fetch_by_class_with_json(self, server: Server, tmp_path: Path) -> None:
        server.script["/02/02_01.amc"] = [whole(MOTION)]
        manifest = write_manifest(
            tmp_path / "m.csv", entry(server), entry(server, "02_03", label="run")
        )
        out = str(tmp_path / "out")
        code, stdout, stderr = self.invoke(
            "walk", "--manifest", manifest, "--out", out, "--json", "--rate", "10"
        )
        assert (code, stderr) == (0, "")
        report = json.loads(stdout)
        assert [Path(path).name for path in report["done"]] == ["02.asf", "02_01.amc"]
        assert report["bytes"] == len(MOTION) + len(SKELETON)
        assert not report["dry_run"]

    def test_failure_is_told_and_exits_with_1(self, server: Server, tmp_path: Path) -> None:
        manifest = write_manifest(tmp_path / "m.csv", entry(server))
        code, stdout, stderr = self.invoke(
            "--all", "--manifest", manifest, "--out", str(tmp_path), "--rate", "10"
        )
        assert code == 1
        assert "1 files downloaded" in stdout
        assert "1 failed" in stdout
        assert "Check the address in the manifest.\n1 file could not be compared" in stderr

    def test_dry_run_touches_nothing(self, server: Server, tmp_path: Path) -> None:
        manifest = write_manifest(tmp_path / "m.csv", entry(server))
        out = tmp_path / "out"
        code, stdout, _ = self.invoke(
            "02", "--manifest", manifest, "--out", str(out), "--dry-run", "--json"
        )
        assert code == 0
        assert len(json.loads(stdout)["missing"]) == 2
        code, stdout, _ = self.invoke("02", "--manifest", manifest, "--out", str(out), "--dry-run")
        assert all(line.endswith("(no checksum)") for line in stdout.splitlines()[:-1])
        assert stdout.splitlines()[-1] == "2 files to download, 0 there already"
        assert server.requests == []
        assert not out.exists()

    @pytest.mark.parametrize("args", [[], ["--dry-run"], ["--all", "walk"]])
    def test_whole_database_must_be_asked_for(self, args: list[str]) -> None:
        code, _, stderr = self.invoke(*args)
        assert code == 2
        assert "--all" in stderr

    def test_shipped_manifest_by_default(self, tmp_path: Path) -> None:
        code, stdout, _ = self.invoke("salsa", "--dry-run", "--json", "--out", str(tmp_path))
        assert code == 0
        assert len(json.loads(stdout)["missing"]) == 32  # 30 clips of two subjects

    def test_unknown_name(self) -> None:
        with pytest.raises(CorpusError, match=r"'wlak'\. Close: walk"):
            self.invoke("wlak", "--dry-run")

    def test_help_has_an_example(self) -> None:
        code, stdout, _ = self.invoke("--help")
        assert code == 0
        assert "  mocapdb fetch 02_01 02_03 07_01 --out cmu\n" in stdout
