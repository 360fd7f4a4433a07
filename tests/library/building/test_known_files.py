"""What is known of files before they are read: who says it, and who wins."""

import pytest

from mocapdb.corpus.labels import LabelRow, Labels, read_labels
from mocapdb.errors import CorpusError, FormatError
from mocapdb.io import ReadOptions
from mocapdb.library.building.known_files import KnownFiles


def known(root, file, *, names=None, labels=None, **said):
    if labels is not None:
        (root / "LABELS.csv").write_text(labels)
    table = None if labels is None else read_labels(root / "LABELS.csv")
    return KnownFiles(root, ReadOptions(**said), names, lambda: table).of(file)


def test_without_anything_the_folder_is_the_class(tmp_path):
    fact = known(tmp_path, "walk/a_1.bvh")
    assert (fact.label, fact.subject, fact.description, fact.columns) == ("walk", "", "", {})
    assert fact.reading == ReadOptions()
    assert known(tmp_path, "a.bvh").label is None


def test_names_win_over_folders(tmp_path):
    fact = known(tmp_path, "takes/walk_ana_1.bvh", names="{label}_{subject}_{take}")
    assert (fact.label, fact.subject, fact.columns) == ("walk", "ana", {"take": "1"})
    assert known(tmp_path, "walk/old_1.bvh", names="{style}_{take}").label == "walk"


def test_labels_win_over_names(tmp_path):
    labels = "clip,label,subject,style\nrun_bob_1,jog,,old\n"
    names = "{label}_{subject}_{take}"
    fact = known(tmp_path, "run_bob_1.bvh", names=names, labels=labels)
    assert (fact.label, fact.subject, fact.subject_source) == ("jog", "bob", "caller")
    assert fact.columns == {"take": "1", "style": "old"}
    other = known(tmp_path, "run_ana_2.bvh", names=names, labels=labels)
    assert (other.label, other.subject, other.columns) == ("run", "ana", {"take": "2"})
    labels = "clip,label,subject\nrun_bob_1,jog,Bo\n"
    fact = known(tmp_path, "run_bob_1.bvh", names=names, labels=labels)
    assert (fact.subject, fact.subject_source) == ("Bo", "labels")


def test_the_command_line_wins_over_the_settings(tmp_path):
    (tmp_path / "mocapdb.toml").write_text(
        'names = "{label}_{take}"\nunit_m = 0.5\nfps = 60\n["b/*"]\nnames = "{take}"'
    )
    fact = known(tmp_path, "a/walk_1.bvh", unit_m=0.25)
    assert (fact.label, fact.columns) == ("walk", {"take": "1"})
    assert fact.reading == ReadOptions(unit_m=0.25, fps=60.0)
    assert fact.by_settings == {"fps"}
    assert known(tmp_path, "b/walk_1.bvh").columns == {"take": "walk_1"}
    assert known(tmp_path, "b/walk_1.bvh", names="{style}_{take}").columns == {
        "style": "walk", "take": "1"
    }  # fmt: skip


@pytest.mark.parametrize(("file", "rate"), [("a.amc", 60.0), ("a.bvh", None)])
def test_rates_of_labels_are_for_amc(tmp_path, file, rate):
    labels = "clip,label,fps\na,walk,60\n"
    assert known(tmp_path, file, labels=labels).label_fps == rate
    assert known(tmp_path, file, labels=labels, fps=30).label_fps is None


def test_skeletons_are_for_amc(tmp_path):
    path = tmp_path / "a.asf"
    path.touch()
    (tmp_path / "mocapdb.toml").write_text('skeleton = "a.asf"')
    assert known(tmp_path, "a.amc").reading.skeleton == path
    assert known(tmp_path, "a.bvh").reading.skeleton is None
    assert known(tmp_path, "a.bvh", skeleton=path).reading.skeleton is None


def test_a_pattern_that_does_not_fit_names_the_file(tmp_path):
    message = r"walk\.bvh: Expected a name such as '\{label\}_\{take\}', but got 'walk'"
    with pytest.raises(FormatError, match=message):
        known(tmp_path, "a/walk.bvh", names="{label}_{take}")


def test_a_pattern_that_cannot_be_names_who_says_it(tmp_path):
    with pytest.raises(CorpusError, match=r"^--names: .*'path', which is reserved"):
        known(tmp_path, "a.bvh", names="{path}")
    (tmp_path / "mocapdb.toml").write_text('names = "{label}{take}"')
    with pytest.raises(CorpusError, match=r"mocapdb\.toml: names: .*nothing between"):
        known(tmp_path, "a.bvh")


def test_who_says_who_performs(tmp_path):
    (tmp_path / "mocapdb.toml").write_text('names = "{subject}_{label}"')
    assert known(tmp_path, "ana_walk.bvh").subject_source == "settings"
    said = known(tmp_path, "walk_ana.bvh", names="{label}_{subject}")
    assert (said.subject, said.subject_source) == ("ana", "caller")


def test_rows_of_labels_that_fit_no_file_are_counted(tmp_path):
    rows = [LabelRow("walk", "a"), LabelRow("run", "nobody"), LabelRow("run", path="../b.bvh")]
    files = KnownFiles(tmp_path, ReadOptions(), None, lambda: Labels(rows))
    files.of("a.bvh")
    assert files.unused().warnings() == ["1 of 2 rows of the labels fit no file, such as 'nobody'"]
    files.of("nobody.bvh")
    assert files.unused().warnings() == []
    files = KnownFiles(tmp_path, ReadOptions(), "{style}_{take}", lambda: Labels(rows[:1]))
    with pytest.raises(FormatError):  # the name does not fit its pattern, but the row fits the file
        files.of("a.bvh")
    assert files.unused().warnings() == []
    manifest = KnownFiles(tmp_path, ReadOptions(), None, lambda: Labels(rows, source="manifest"))
    assert manifest.unused().warnings() == []
