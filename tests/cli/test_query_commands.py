"""``mocapdb query``, ``classify`` and ``index`` as a user calls them."""

import json

import pytest
from click.testing import CliRunner

from mocapdb.cli import cli
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip
from mocapdb.plots import query_hits


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
    why = answer["hits"][0]["why"]
    assert set(why["parts"]) == {"head", "trunk", "left-arm", "right-arm", "left-leg", "right-leg"}
    assert all(part["apart"] < 0.7 for part in why["parts"].values())
    assert len(why["joints"]) == 17
    moments = why["moments"]
    assert len(moments["query_s"]) == len(moments["clip_s"]) == len(moments["apart"])
    assert moments["query_s"][-1] == pytest.approx(1.5, abs=0.1)


def test_hits_and_classes_as_csv(here):
    library, take = here / "lib.mocapdb", here / "take.bvh"
    hits = run("query", library, take, "--frames", "120:300", "-k", 2, "--csv").stdout.splitlines()
    assert hits[0].startswith("clip,start,end,")
    assert "why" not in hits[0]
    assert len(hits) == 3
    head, row = run("classify", library, take, "--csv").stdout.splitlines()
    told = dict(zip(head.split(","), row.split(","), strict=True))
    assert (told["clip"], told["class"]) == ("take", "walk")


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


def test_a_picture_says_what_it_shows(here, tmp_path, monkeypatch):
    drawn = []

    def keep(*arguments, **options):
        drawn.append((arguments, options))
        return query_hits(*arguments, **options)

    monkeypatch.setattr("mocapdb.plots.query_hits", keep)
    long = tmp_path / "long.bvh"
    take = read_clip(here / "take.bvh")
    write_clip(take, long)
    done = run("query", here / "lib.mocapdb", long, "-k", 6, "--plot", tmp_path / "why.png")
    assert "why.png: the first 5 of 6 hits" in done.output
    (example, clips, titles), options = drawn[0]
    assert "(the first 5 of 6 hits)" in options["query_title"]
    assert example.duration_s == pytest.approx(3.0, abs=0.05)  # as long as the longest clip
    times = options["times_s"]
    assert times[0][-1] - times[0][0] == pytest.approx(3.0, abs=0.05)
    assert [len(own) for own in times[1:]] == [len(clip) for clip in clips]
    assert all(own.min() >= 0 and own.max() < 3.0 for own in times[1:])  # of the hit's clip
    assert len(titles) == 5


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
        (("lib", "take.bvh", "--subject", "77"), 1, "no clip has subject '77'"),
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


def test_a_query_is_saved_and_asked_again(here, tmp_path):
    import shutil

    library = shutil.copytree(here / "lib.mocapdb", tmp_path / "lib.mocapdb")
    asked = ("query", library, here / "take.bvh", "--to", 2, "--probability", ".6")
    done = run(*asked, "--subject", "02", "--root-speed", "0.1:", "--save", "walks", "--json")
    hits = json.loads(done.stdout)["hits"]
    assert {hit["clip"] for hit in hits} == {"02_01"}
    assert all(hit["probability"] >= 0.6 for hit in hits)
    assert f"saved as 'walks' (--probability 0.6, 1000 hits at most): mocapdb ls {library}" in (
        done.stderr
    )
    (again,) = json.loads(run("ls", library, "--query", "walks", "--json").stdout)["clips"]
    assert [hit["start"] for hit in again["hits"]] == [hit["start"] for hit in hits]
    assert "1 clip that 'walks' finds" in run("ls", library, "--query", "walks").stdout
    assert "It has: walks" in run("ls", library, "--query", "wolks", code=1).stderr
    wrong = run(*asked[:-1], "nan", code=1)
    assert "probability from 0 to 1" in wrong.stderr


def test_facets_choose_clips(here):
    library = here / "lib.mocapdb"
    walks = ["01_01", "02_01", "03_01"]
    asked = ("ls", library, "--root-speed", "0.5:", "--turn", "-45:45", "--height", ":2.5")
    clips = json.loads(run(*asked, "--contacts", "2:", "--duration", "2.9:3.1", "--json").stdout)
    assert [clip["clip"] for clip in clips["clips"]] == walks
    assert set(clips["clips"][0]["facets"]) == {"root_speed_ms", "turn_deg", "contacts"}
    out = run(*asked, "--columns", "root-speed,turn,height,contacts").stdout
    assert all(unit in out for unit in ("m/s", "deg", "3 clips"))
    answer = run("query", library, here / "take.bvh", "--root-speed", "0.5:", "--json").stdout
    assert {hit["clip"] for hit in json.loads(answer)["hits"]} == set(walks)
    done = run("ls", library, "--flagged", "no")
    assert "0 clips" in done.stdout
    assert "9 clips are left out, not searched for faults yet: mocapdb clean" in done.stderr


@pytest.mark.parametrize(
    ("option", "text", "message"),
    [
        ("--root-speed", "nan:1", "Expected numbers for root-speed"),
        ("--root-speed", "2:1", "Say 1:2"),
        ("--duration", "-1:", "Expected a duration of 0 or more"),
        ("--turn", "left", "Expected a range A:B, A: or :B, but got 'left'"),
        ("--contacts", ":", "Expected a range"),
        ("--flagged", "maybe", "'maybe' is not one of"),
    ],
)
def test_facets_that_cannot_be(here, option, text, message):
    for command in (("ls",), ("query", "take.bvh")):
        done = run(command[0], here / "lib.mocapdb", *command[1:], option, text, code=2)
        assert message in done.stderr


def test_an_earlier_version_has_measured_nothing(here, tmp_path):
    import shutil
    import sqlite3

    old = shutil.copytree(here / "lib.mocapdb", tmp_path / "old.mocapdb")
    with sqlite3.connect(old / "catalogue.db") as connection:
        connection.execute("DROP TABLE facets")
        connection.execute("PRAGMA user_version = 4")
    connection.close()
    done = run("ls", old, "--turn", "0:", code=1)
    assert f"Measure them with: mocapdb index {old}" in done.stderr
    assert "9 clips" in run("ls", old, "--duration", "1:", "--columns", "turn").stdout
    assert "measured speed, turn and contacts of 9 clips" in run("index", old).stdout
    assert "3 clips" in run("ls", old, "--root-speed", "0.5:").stdout


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


def test_classes_grow_and_are_taken_back(here, tmp_path):
    corpus, library = tmp_path / "corpus", tmp_path / "grow.mocapdb"
    corpus.mkdir()
    for path in (here / "corpus").iterdir():
        (corpus / path.name).write_bytes(path.read_bytes())
    lines = (corpus / "LABELS.csv").read_text().splitlines()
    # nobody says what the hops are, nor one of the walks
    kept = [line + ",style" for line in lines[:1]]
    kept += [line + ",brisk" for line in lines[1:] if ",hop" not in line and "03_01" not in line]
    (corpus / "LABELS.csv").write_text("\n".join(kept) + "\n")
    run("build", corpus, "-o", library, "--mean-mm", "4", "--representation", "channels",
        "--transform", "dct")  # fmt: skip
    report = json.loads(run("classify", library, "--grow", "--json").stdout)
    labels = {clip["clip"]: clip["class"] for clip in report["clips"]}
    assert labels["03_01"] == "walk"
    assert {labels[f"0{person}_03"] for person in (1, 2, 3)} == {"new 1"}
    ((opened),) = report["opened"]
    assert opened["class"] == "new 1"
    assert all(clip["novelty"] > 1 for clip in opened["clips"])
    assert "new 1" in run("ls", library, "--class", "new 1").stdout
    assert "every clip" in run("classify", library, "--grow").stdout
    assert "took back the label of 4 clips" in run("classify", library, "--undo").stdout
    assert "no clip has class 'new 1'" in run("ls", library, "--class", "new 1", code=1).stderr
    out = run("classify", library, "--grow").stdout
    assert "new 1 was opened, since these fit no class:" in out
    # and another column
    answer = json.loads(run("classify", library, "01_01", "--by", "style", "--json").stdout)
    assert [score["class"] for score in answer["ranking"]] == ["brisk"]
    answer = json.loads(run("classify", library, "01_01", "--by", "subject", "--json").stdout)
    assert {score["class"] for score in answer["ranking"]} == {"01", "02", "03"}
    assert "expected a column out of" in run("classify", library, "01_01", "--by", "stile",
                                             code=1).stderr  # fmt: skip


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--grow", "--undo"), "one of --apply, --grow and --undo"),
        (("01_01", "--grow"), "--grow and --undo alone"),
        (("--by", "style", "--where", "a=b"), "--by without --where"),
        (("--by", "style", "--apply"), "only classes are written"),
    ],
)
def test_what_does_not_go_together(here, options, message):
    assert message in run("classify", here / "lib.mocapdb", *options, code=2).stderr


def test_index_adds_what_is_missing(here, tmp_path):
    import shutil

    bare = shutil.copytree(here / "bare.mocapdb", tmp_path / "bare.mocapdb")
    report = json.loads(run("index", bare, "--json").stdout)
    assert (report["indexed"], report["classes"]) == (9, 3)
    assert "walk" in run("query", bare, here / "take.bvh", "-k", 1).stdout


@pytest.mark.parametrize(("option", "value"), [("--from", "nan"), ("--to", "inf"), ("--to", "nan")])
def test_seconds_are_numbers(here, option, value):
    done = run("query", here / "lib.mocapdb", here / "take.bvh", option, value, code=2)
    assert f"Expected seconds with {option}, but got {value}." in done.output


def test_a_whole_library_by_a_column(here):
    answer = json.loads(run("classify", here / "lib.mocapdb", "--by", "subject", "--json").stdout)
    assert answer["by"] == "subject"
    assert [each["said"] for each in answer["clips"]] == ["01"] * 3 + ["02"] * 3 + ["03"] * 3
    for each in answer["clips"]:  # or nobody could be recognised
        assert each["said"] in {score["class"] for score in each["ranking"]}
    done = run("classify", here / "lib.mocapdb", "--by", "subject")
    assert "of 9 clips are what subject says of them" in done.stdout
    assert "note: each clip is seen by classes learned from other clips" in done.stderr
    done = run("classify", here / "lib.mocapdb", "--by", "subjct", code=1)
    assert "Did you mean subject?" in done.output


@pytest.fixture(scope="module")
def styled(here, tmp_path_factory):
    """A library whose clips have further columns, one value with a comma, and two that are odd."""
    folder = tmp_path_factory.mktemp("styled")
    labels = ["clip,label,style,take"]
    for name, label, style, take in (
        ("01_01", "walk", "old", "1"),
        ("02_01", "walk", "old", "2"),
        ("03_01", "walk", "old, very", "2"),
    ):
        (folder / f"{name}.bvh").write_bytes((here / "corpus" / f"{name}.bvh").read_bytes())
        labels.append(f'{name},{label},"{style}",{take}')
    write_clip(read_clip(folder / "01_01.bvh")[:2], folder / "two.bvh")
    (folder / "LABELS.csv").write_text("\n".join(labels) + "\n")
    codec = ("--mean-mm", "4", "--representation", "channels", "--transform", "dct")
    run("build", folder, "-o", folder / "lib.mocapdb", *codec)
    return folder / "lib.mocapdb"


def names_of(done):
    return [clip["clip"] for clip in json.loads(done.stdout)["clips"]]


@pytest.mark.parametrize(
    ("condition", "names"),
    [
        ("style=old", ["01_01", "02_01"]),
        ("style=old,take=2", ["02_01"]),
        ("style=old, very", ["03_01"]),
        ("take=2,style=old, very", ["03_01"]),
    ],
)
def test_commas_part_conditions_unless_they_are_in_a_value(styled, here, condition, names):
    assert names_of(run("ls", styled, "--where", condition, "--json")) == names
    done = run("query", styled, here / "take.bvh", "--where", condition, "--json")
    assert {hit["clip"] for hit in json.loads(done.stdout)["hits"]} == set(names)


def test_who_is_left_out_is_said_where_nobody_is_known(here, tmp_path):
    labels = ["clip,label,style"]
    for name, clip, style in (("a", "01_01", "old"), ("b", "02_01", "old"), ("c", "03_02", "odd")):
        (tmp_path / f"{name}.bvh").write_bytes((here / "corpus" / f"{clip}.bvh").read_bytes())
        labels.append(f"{name},unknown,{style}")
    (tmp_path / "LABELS.csv").write_text("\n".join(labels) + "\n")
    codec = ("--mean-mm", "4", "--representation", "channels", "--transform", "dct")
    run("build", tmp_path, "-o", tmp_path / "lib.mocapdb", *codec)
    done = run("classify", tmp_path / "lib.mocapdb", "--by", "style", "--json")
    (note,) = json.loads(done.stdout)["notes"]
    assert "nobody knows who performs the 3 clips" in note
    assert "that flatters" in note
    assert note in done.stderr


def test_conditions_that_cannot_be(styled):
    wrong = run("ls", styled, "--where", "style=old,tkae=2", code=1)
    assert "'tkae'. Did you mean take?" in wrong.stderr
    assert "'style' twice" in run("ls", styled, "--where", "style=a,style=b", code=1).stderr
    assert "with --class" in run("ls", styled, "--where", "class=walk", code=1).stderr


def test_a_list_says_what_nobody_has(styled):
    done = run("ls", styled, "--where", "style=oldd")
    assert "0 clips" in done.stdout
    assert "no clip has style 'oldd'. Did you mean old?" in done.stderr
    assert "Did you mean walk?" in run("ls", styled, "--class", "wakl", code=1).stderr
    assert names_of(run("ls", styled, "--subject", "02", "--json")) == ["02_01"]
    done = run("query", styled, "01_01", "--not-subject", "xyz")
    assert "leaves nobody out" in done.stderr


def test_what_cannot_be_measured_is_not_to_be_measured(styled):
    done = run("ls", styled, "--root-speed", "0:10")
    assert "3 clips" in done.stdout
    assert "1 clip is left out, cannot be measured" in done.stderr
    assert "yet" not in done.stderr


def test_a_library_of_one_clip_says_so(here, tmp_path):
    (tmp_path / "01_01.bvh").write_bytes((here / "corpus" / "01_01.bvh").read_bytes())
    codec = ("--mean-mm", "4", "--representation", "channels", "--transform", "dct")
    run("build", tmp_path, "-o", tmp_path / "one.mocapdb", *codec)
    wrong = run("query", tmp_path / "one.mocapdb", "01_01", code=1)
    assert "no other clip that can be searched than 01_01" in wrong.stderr


def test_saved_queries_are_listed_and_forgotten(here, tmp_path):
    import shutil

    library = shutil.copytree(here / "lib.mocapdb", tmp_path / "my lib.mocapdb")
    asked = ("query", library, here / "take.bvh", "--to", 2, "-k", 3)
    done = run(*asked, "--save", "it's; DROP")
    assert f"ls '{library}' --query 'it'\"'\"'s; DROP'" in done.stderr
    assert "--probability 0.6" in run(*asked, "--probability", ".6", "--save", "near").stderr
    assert "on one line" in run(*asked, "--save", "a\nb", code=1).stderr
    kept = json.loads(run("ls", library, "--queries", "--json").stdout)["queries"]
    assert [each["query"] for each in kept] == ["it's; DROP", "near"]
    assert kept[1]["options"]["probability"] == 0.6
    assert "2 saved queries" in run("ls", library, "--queries").stdout
    assert "speed" in run("ls", library, "--query", "near").stdout
    assert "without CLIP" in run("query", library, "x", "--forget", "near", code=2).stderr
    run("query", library, "--forget", "near")
    assert "1 saved query" in run("ls", library, "--queries").stdout
    assert "no query is saved as 'near'" in run("query", library, "--forget", "near", code=1).stderr


def test_a_query_says_what_is_odd_about_it(here):
    library = here / "lib.mocapdb"
    done = run("query", library, "01_01", "--to", 0.29, "--joints", "legs", "--unlike", "01_01")
    assert "01_01 is asked for and not meant as well" in done.stderr
    assert "rough guess" in done.stderr
    done = run("query", library, "01_01", "--unlike", "01_01")
    assert "what is not meant is the query itself" in done.stderr
    assert (
        "Did you mean: 01_01" in run("query", library, "01_01", "--unlike", "01_1", code=1).stderr
    )
    assert "goes after '--'" in run("query", library, "-dash", code=2).stderr
    assert "Missing argument" in run("query", library, code=2).stderr
