"""``mocapdb query``, ``classify`` and ``index`` as a user calls them."""

import json

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with a library of three people and three kinds of motion, and a take."""
    folder = tmp_path_factory.mktemp("query")
    corpus = folder / "corpus"
    corpus.mkdir()
    labels = ["clip,label,description"]
    for person in (1, 2, 3):
        skeleton = synthetic.subject(person)
        for number, kind in enumerate(("walk", "squat", "hop"), start=1):
            name = f"{person:02d}_{number:02d}"
            clip = synthetic.make_clip(
                kind, seed=person + 10 * number, skeleton=skeleton, duration_s=3, name=name
            )
            write_clip(clip, corpus / f"{name}.bvh")
            labels.append(f"{name},{kind},someone {kind}s")
    (corpus / "LABELS.csv").write_text("\n".join(labels) + "\n")
    take = synthetic.make_clip("walk", seed=9, skeleton=synthetic.subject(9), duration_s=4)
    write_clip(take, folder / "take.bvh")
    codec = ("--mean-mm", "4", "--representation", "channels", "--transform", "dct")
    for name, more in (("lib", ()), ("bare", ("--no-index",))):
        run("build", str(corpus), "-o", str(folder / f"{name}.mocapdb"), *codec, *more)
    return folder


def run(*arguments, code=0):
    done = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert done.exit_code == code, done.output
    return done


def test_query_prints_a_table(here):
    out = run("query", here / "lib.mocapdb", here / "take.bvh", "--from", 1, "--to", 2.5).stdout
    assert all(word in out for word in ("distance", "speed", "walk", "10 hits in"))


def test_query_json_is_the_contract(here):
    done = run(
        "query", here / "lib.mocapdb", here / "take.bvh", "--frames", "120:300", "-k", 3, "--json"
    )
    answer = json.loads(done.stdout)
    assert answer["query"] == {"clip": "take", "start": 1.0, "end": 2.5}
    assert len(answer["hits"]) == 3
    for hit in answer["hits"]:
        assert {"clip", "start", "end", "distance", "class", "time_scale"} <= set(hit)
        assert hit["class"] == "walk"
    distances = [hit["distance"] for hit in answer["hits"]]
    assert distances == sorted(distances)
    assert answer["seconds"] > 0


def test_parts_of_the_body_and_what_is_not_meant(here):
    library = here / "lib.mocapdb"
    done = run("query", library, "01_01", "--joints", "legs,left-wrist", "--unlike", "01_02",
               "--unlike", "01_03", "-k", 3, "--json")  # fmt: skip
    answer = json.loads(done.stdout)
    assert answer["joints"] == ["legs", "left-wrist"]
    assert len(answer["unlike"]) == 2
    assert {hit["class"] for hit in answer["hits"]} == {"walk"}
    wrong = run("query", library, "01_01", "--joints", "left-amr", code=1)
    assert "Did you mean left-arm?" in wrong.stderr
    wrong = run("query", library, "01_01", "--max-distance", "nan", code=1)
    assert "distance of 0 or more" in wrong.stderr


def test_a_clip_of_the_library_does_not_find_itself(here):
    done = run("query", here / "lib.mocapdb", "01_02", "--to", 1.5, "-k", 4, "--json")
    assert "01_02" not in {hit["clip"] for hit in json.loads(done.stdout)["hits"]}


def test_hits_are_exported_and_drawn(here, tmp_path):
    run(
        "query", here / "lib.mocapdb", "01_01", "-k", 2, "--class", "walk", "--whole",
        "-o", tmp_path / "hits", "--plot", tmp_path / "hits.png",
    )  # fmt: skip
    paths = sorted((tmp_path / "hits").iterdir())
    assert [path.name[:6] for path in paths] in (["01_02_", "02_03_"], ["01_03_", "02_02_"])
    assert len(read_clip(paths[0])) == 360
    assert (tmp_path / "hits.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("way", ["--rough", "--exact"])
def test_rough_and_exact_find_the_same_nearest(here, way):
    asked = ("query", here / "lib.mocapdb", here / "take.bvh", "--to", 1.5, "-k", 1, "--json")
    plain, told = (json.loads(run(*arguments).stdout) for arguments in (asked, (*asked, way)))
    assert told["hits"] == plain["hits"]


def test_info_says_what_the_index_takes(here):
    indexed, bare = (
        json.loads(run("info", here / f"{name}.mocapdb", "--json").stdout)
        for name in ("lib", "bare")
    )
    assert 0 == bare["index_bytes"] < indexed["index_bytes"] < indexed["disk_bytes"]


def test_nothing_is_that_near(here):
    done = run("query", here / "lib.mocapdb", "01_01", "--max-distance", 1e-9)
    assert "no stretch is that near" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("lib", "take.bvh", "--from", 1, "--to", 1.1), 1, "0.3 s or more"),
        (("lib", "take.bvh", "--to", 77), 1, "within the 4.00 s"),
        (("lib", "take.bvh", "--frames", "300:120"), 1, "frames 300:120"),
        (("lib", "take.bvh", "--frames", "x"), 2, "--frames A:B"),
        (("lib", "take.bvh", "--frames", "1:90", "--to", 1), 2, "but got both"),
        (("lib", "take.bvh", "01_01", "--to", 1), 2, "one clip for a range"),
        (("lib", "take.bvh", "--class", "fly"), 1, "no clip has class 'fly'"),
        (("lib", "take.bvh", "--subject", "77"), 1, "fits subject '77'"),
        (("lib", "take.bvh", "--weights", "1,2"), 2, "four numbers"),
        (("lib", "take.bvh", "--weights", "1,2,3,-4"), 1, "turn_ms to be 0 or more"),
        (("lib", "nothing-like-it.bvh"), 1, "is neither"),
        (("bare", "take.bvh"), 1, "Add them with: mocapdb index"),
        (("missing", "take.bvh"), 1, "not a library"),
    ],
)
def test_what_goes_wrong_is_said(here, arguments, code, message):
    library, clip, *options = arguments
    path = here / clip if (here / clip).exists() else clip
    done = run("query", here / f"{library}.mocapdb", path, *options, code=code)
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_classify_a_clip(here):
    library = here / "lib.mocapdb"
    answer = json.loads(run("classify", library, here / "take.bvh", "--json").stdout)
    assert (answer["clip"], answer["ranking"][0]["class"]) == ("take", "walk")
    assert set(answer) >= {"clip", "rejected", "ranking"}
    assert set(answer["ranking"][0]) == {"class", "posterior", "share"}
    out = run("classify", library, here / "take.bvh", "--segments").stdout
    assert "take: walk" in out
    assert "0.00 to" in out


def test_classify_a_folder_and_the_unlabelled(here):
    library = here / "lib.mocapdb"
    answers = json.loads(run("classify", library, here / "corpus", "--json").stdout)["clips"]
    assert len(answers) == 9
    assert {"walk", "squat", "hop"} == {answer["ranking"][0]["class"] for answer in answers}
    assert all(answer.keys() >= {"unit_m_source", "up_source", "fps_source"} for answer in answers)
    assert "every clip that can be searched has a label" in run("classify", library).stdout
    run("classify", library, here / "take.bvh", "--apply", code=2)


def test_index_adds_what_is_missing(here, tmp_path):
    import shutil

    bare = shutil.copytree(here / "bare.mocapdb", tmp_path / "bare.mocapdb")
    report = json.loads(run("index", bare, "--json").stdout)
    assert (report["indexed"], report["classes"]) == (9, 3)
    assert "walk" in run("query", bare, here / "take.bvh", "-k", 1).stdout
