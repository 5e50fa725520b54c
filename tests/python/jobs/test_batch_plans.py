# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what a batch reads, writes and records, without Blender: inputs, job files, journals."""

import argparse
import glob
import json
import sys
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import pytest
from sinew_addon.base.errors import SinewError, WrongUse
from sinew_addon.commands import batch
from sinew_addon.jobs.inputs import plan_jobs
from sinew_addon.jobs.job_file import ObjectRule, Settings, keys, markdown, read_job_file
from sinew_addon.jobs.journal import NAME, Journal, stamp

METHODS = ("lbs", "dq")


def test_without_dask_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "sinew_addon.jobs.dask_cluster", raising=False)
    args = argparse.Namespace(scheduler="tcp://127.0.0.1:1", jobs=None, timeout=None, memory=None)
    workers = batch.Workers(args, 1, SimpleNamespace(verbose=False), 0)
    with pytest.raises(SinewError, match=r"pip install 'sinew-blender\[cluster\]'"):
        workers.run([{}], None)


@pytest.fixture
def studio(tmp_path, monkeypatch):
    """A folder with files, which is the current folder."""
    folder = tmp_path / "studio"
    for name in ("a.blend", "chars/hero.blend", "chars/old/hero.blend", "chars/fox.glb", "take/b[1].blend"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    (folder / "empty").mkdir()
    monkeypatch.chdir(folder)
    return folder


def planned(inputs, out="out", listed=()):
    """Sources and copies, relative to the current folder."""
    jobs = plan_jobs(inputs, Path(out), listed)
    return {
        job.source.relative_to(Path.cwd()).as_posix(): job.target.relative_to(Path.cwd()).as_posix()
        for job in jobs
    }


HEROES = {"chars/hero.blend": "out/hero.blend", "chars/old/hero.blend": "out/old/hero.blend"}
ALL = {name: f"out/{name}" for name in ("a.blend", "take/b[1].blend", *HEROES)}


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        (["a.blend"], {"a.blend": "out/a.blend"}),
        (["take/b[1].blend"], {"take/b[1].blend": "out/b[1].blend"}),
        (["chars/fox.glb"], {"chars/fox.glb": "out/fox.blend"}),
        (["chars"], HEROES),
        (["chars/**/*.blend"], HEROES),
        (["ch*/old/*.blend"], {"chars/old/hero.blend": "out/chars/old/hero.blend"}),
        # Given twice and also by its folder; processed once.
        (["a.blend", "./a.blend", "."], ALL),
    ],
)
def test_inputs(studio, inputs, expected):
    assert planned(inputs) == expected


def test_a_list_keeps_folders_below_the_common_one(studio):
    lines = ["chars/hero.blend\n", "\n", f"{studio}/chars/old/hero.blend\r\n"]
    assert planned(["-"], listed=lines) == HEROES
    assert planned(["-"], listed=["a.blend\n", "chars/hero.blend\n"]) == {
        "a.blend": "out/a.blend",
        "chars/hero.blend": "out/chars/hero.blend",
    }


def test_a_folder_with_brackets_is_no_pattern(studio, monkeypatch):
    folder = studio / "take [2]" / "old"
    folder.mkdir(parents=True)
    (folder / "b.blend").touch()
    found = {"take [2]/old/b.blend": "out/b.blend"}
    assert planned([str(studio / "take [2]" / "old" / "*.blend")]) == found
    assert planned(["take [2]/**/*.blend"]) == {"take [2]/old/b.blend": "out/old/b.blend"}
    monkeypatch.chdir(studio / "take [2]")
    assert planned(["old/*.blend"]) == {"old/b.blend": "out/b.blend"}


def link(path: Path, target: object) -> None:
    """Skips the test if this user may not create links, like most users on Windows, and under wine 8, which
    creates none and reports success."""
    try:
        path.symlink_to(target, target_is_directory=True)
    except OSError:
        pytest.skip("links can not be made here")
    if not path.is_symlink():
        pytest.skip("no link was made here, though the system says so")


def test_names_in_capitals(studio):
    """As old file systems and some programs write them."""
    (studio / "empty/HERO.BLEND").touch()
    assert planned(["empty"]) == {"empty/HERO.BLEND": "out/HERO.blend"}
    assert set(planned(["."])) == {*ALL, "empty/HERO.BLEND"}


def test_linked_folders_and_their_circles(studio):
    link(studio / "chars" / "guests", studio)
    elsewhere = studio.parent / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "c.blend").touch()
    link(studio / "chars" / "more", elsewhere)
    assert set(planned(["chars"])) == {"chars/hero.blend", "chars/old/hero.blend", "chars/more/c.blend"}


def test_copies_of_an_earlier_run_are_not_inputs(studio):
    (studio / "chars" / "out").mkdir()
    (studio / "chars" / "out" / "hero.blend").touch()
    (studio / "chars" / ".0123.unfinished.blend").touch()
    assert sorted(planned(["chars"], "chars/out")) == ["chars/hero.blend", "chars/old/hero.blend"]


@pytest.mark.parametrize(
    ("inputs", "out", "sentence"),
    [
        (["chars"], "chars", "would replace an input"),
        (["a.blend"], ".", "would replace an input"),
        (["chars/hero.blend", "chars/old/hero.blend"], "out", "would both be written"),
        (["x*.blend"], "out", "no file matches"),
        (["empty"], "out", r"no \.blend files"),
        (["-"], "out", "no paths"),
    ],
)
def test_plans_that_are_refused(studio, inputs, out, sentence):
    with pytest.raises(WrongUse, match=sentence):
        planned(inputs, out)


JOB = """\
# For all files.
inputs = ["chars"]
out = "done"
method = "lbs"
exclude = [
    "Proxy*",  # said for all
]
scale = "3.x"

[[objects]]
match = "Face"
method = "dq"

[[files]]
match = ["hero*.blend", "old/*.blend"]
method = "dq"
exclude = []
scale = "none"

[[files.objects]]
match = "Face*"
method = "lbs"
scale = "4.0"
"""


def read(tmp_path, text):
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    return read_job_file(tmp_path / "job.toml", METHODS)


def test_settings_of_files(tmp_path):
    job = read(tmp_path, JOB)
    assert job.inputs == (str(tmp_path / "chars"),)
    assert job.out == str(tmp_path / "done")
    plain = job.settings_of(Path("/x/a.blend"), Settings()).as_task()
    face, of_hero = {"match": "Face", "method": "dq"}, {"match": "Face*", "method": "lbs", "scale": "4.0"}
    of_all = {"include": [], "set": []}
    assert plain == of_all | {"method": "lbs", "scale": "3.x", "exclude": ["Proxy*"], "objects": [face]}
    hero = job.settings_of(Path("/x/hero 1.blend"), Settings()).as_task()
    assert hero == of_all | {"method": "dq", "scale": "none", "exclude": [], "objects": [face, of_hero]}
    assert job.settings_of(Path("/x/old/a.blend"), Settings()).method == "dq"
    # The command line applies to all files, a rule to its own.
    given = Settings(method="dq", include=("Body",))
    assert job.settings_of(Path("/x/a.blend"), given).method == "dq"
    assert job.settings_of(Path("/x/hero.blend"), given).include == ("Body",)


def test_names_of_files_with_brackets(tmp_path):
    job = read(tmp_path, JOB.replace('"hero*.blend", "old/*.blend"', '"take [2]/*.blend", "b[1].blend"'))
    assert job.settings_of(Path("/x/b[1].blend"), Settings()).method == "dq"
    assert job.settings_of(Path("/x/b1.blend"), Settings()).method == "dq"
    assert job.settings_of(Path("/x/b[2].blend"), Settings()).method == "lbs"
    # In the pattern, the first folder is "take 2".
    assert job.settings_of(Path("/x/take 2/a.blend"), Settings()).method == "dq"


def test_a_byte_order_mark_is_no_key(tmp_path):
    assert read(tmp_path, "\ufeff" + JOB).settings.method == "lbs"


@pytest.mark.parametrize(
    ("old", "new", "line", "sentence"),
    [
        ('method = "lbs"\nexclude', 'method = "best"\nexclude', 4, "expected one of lbs, dq, got 'best'"),
        ('out = "done"', "out = 3", 3, "out: expected text in quotes, got 3"),
        ('out = "done"', 'output = "done"', 3, "output: no such key; expected one of inputs"),
        ('"Proxy*",', "7,", 5, "exclude: expected a list such as"),
        ('"3.x"', '"2.79"', 8, "scale: expected one of 4.0, 3.x, none, got '2.79'"),
        ('match = "Face"\n', "", 10, "match is missing"),
        ('method = "dq"\n\n[[files]]', "[[files]]", 10, "these objects have no settings"),
        ('method = "dq"\nexclude', 'methd = "dq"\nexclude', 16, "methd: no such key"),
        ('match = "Face*"\nmethod = "lbs"', 'match = "Face*"\nmethod = "dqs"', 22, "got 'dqs'"),
        ('match = "Face*"\n', "match = []\n", 21, "match: expected text in quotes"),
        ('match = ["hero*.blend", "old/*.blend"]', 'match = "."', 15, "match: expected paths such as"),
        (
            "[[files.objects]]",
            "[files.objects]",
            20,
            r"objects: expected entries that begin with \[\[files.objects",
        ),
        ('"4.0"', "4.0", 23, "scale: expected text in quotes, got 4.0"),
    ],
)
def test_errors_have_a_line(tmp_path, old, new, line, sentence):
    assert JOB.count(old) == 1
    with pytest.raises(WrongUse, match=rf"job\.toml:{line}: .*{sentence}"):
        read(tmp_path, JOB.replace(old, new))


def test_parameters_of_files_and_objects(tmp_path):
    """Values on the command line override the file's, and a rule overrides both."""
    text = 'method = "lbs"\nset = ["mix=dq", "mix.group=Arms"]\n'
    text += '[[objects]]\nmatch = "Head"\nset = "mix=off"\n'
    job = read(tmp_path, text)
    task = job.settings_of(Path("/x/a.blend"), Settings(set=("mix.group=Legs",))).as_task()
    assert task["set"] == ["mix=dq", "mix.group=Arms", "mix.group=Legs"]
    assert task["objects"] == [{"match": "Head", "set": ["mix=off"]}]
    with pytest.raises(WrongUse, match=r"job\.toml:2: set: mix: expected one of off, lbs, .*, got 'none'"):
        read(tmp_path, text.replace("mix=dq", "mix=none"))


def test_errors_of_the_format_have_a_line(tmp_path):
    with pytest.raises(WrongUse, match=r"line 4, column 10"):
        read(tmp_path, JOB.replace('method = "lbs"\nexclude', "method = lbs\nexclude"))
    (tmp_path / "job.toml").write_bytes(b"\n\nout = '\xff'\n")
    with pytest.raises(WrongUse, match=r"job\.toml:3: is not UTF-8"):
        read_job_file(tmp_path / "job.toml", METHODS)
    with pytest.raises(WrongUse, match="can not be read"):
        read_job_file(tmp_path / "none.toml", METHODS)


def test_every_key_of_a_job_file_is_documented():
    batch = (Path(__file__).resolve().parents[3] / "docs" / "batch.md").read_text(encoding="utf-8")
    assert markdown() in batch


def test_the_keys_and_the_settings_are_the_same():
    """A key that is read and then ignored would be accepted without effect."""
    known = {key.name for key in keys()}
    assert known == {field.name for field in fields(Settings)} | {"inputs", "out", "files", "match"}
    assert {field.name for field in fields(ObjectRule)} == {"match", "method", "scale", "set"}


def saved(folder):
    """A copy that was saved but not renamed, and its record."""
    unfinished = folder / ".1.unfinished.blend"
    unfinished.write_bytes(b"a copy")
    return {"unfinished": unfinished.name, "written": stamp(unfinished), "source": "a.blend"}


def test_a_killed_run_is_finished_by_the_next(tmp_path):
    target = tmp_path / "a.blend"
    with Journal(tmp_path) as journal:
        record = saved(tmp_path)
        journal.record(target, record)
    assert not target.exists()
    with Journal(tmp_path) as journal:
        journal.recover()
        assert target.read_bytes() == b"a copy"
        assert journal.matches(target, journal.latest["a.blend"])
        target.write_bytes(b"edited")
        journal.recover()
        assert not journal.matches(target, journal.latest["a.blend"])


def test_files_without_a_record_are_removed(tmp_path):
    saved(tmp_path)
    (tmp_path / ".2.unfinished.blend@").write_bytes(b"Blender's own")
    with Journal(tmp_path) as journal:
        journal.recover()
        journal.remove_unfinished([tmp_path / "a.blend"])
    assert sorted(path.name for path in tmp_path.iterdir()) == [NAME]


def test_half_a_line_is_ignored(tmp_path):
    with Journal(tmp_path) as journal:
        journal.record(tmp_path / "a.blend", {"error": "one"})
        journal.record(tmp_path / "b.blend", {"error": "two"})
    whole = (tmp_path / NAME).read_bytes()
    second = whole.index(b"\n") + 1
    for length in range(second, len(whole)):
        (tmp_path / NAME).write_bytes(whole[:length])
        with Journal(tmp_path) as journal:
            assert list(journal.latest) == ["a.blend"]
            journal.record(tmp_path / "c.blend", {"error": "three"})
        lines = [json.loads(line) for line in (tmp_path / NAME).read_bytes().splitlines()]
        assert [line["file"] for line in lines] == ["a.blend", "c.blend"]


def test_one_batch_at_a_time(tmp_path):
    with Journal(tmp_path), pytest.raises(WrongUse, match="another batch is at work there"):
        Journal(tmp_path)
    Journal(tmp_path).__exit__()


def test_a_journal_that_can_not_be_written(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(SinewError, match="can not be written"):
        Journal(tmp_path / "file" / "out")
    with Journal(tmp_path) as journal:
        # A name with the byte 0xff on Linux, or with half a surrogate pair on Windows.
        journal.record(tmp_path / "\udcff.blend", {"error": "names need not be text"})
    with Journal(tmp_path) as journal:
        assert list(journal.latest) == ["\udcff.blend"]


@pytest.mark.parametrize(
    "line",
    [
        {"file": "../out.blend"},
        {"file": "/tmp/out.blend"},
        {"file": "link/a.blend"},
        {"file": "a.blend", "unfinished": "mine.blend"},
        {"file": "a.blend", "unfinished": "../../.1.unfinished.blend"},
        {"file": "a.blend", "unfinished": 7},
        {"file": ["a.blend"]},
        ["a.blend"],
        "a.blend",
    ],
)
def test_a_journal_moves_only_unfinished_files_of_its_folder(tmp_path, line):
    """A folder may come from anyone, and contain a journal that moves files."""
    out, elsewhere = tmp_path / "deep" / "out", tmp_path / "elsewhere"
    for folder in (out, elsewhere):
        folder.mkdir(parents=True)
        for name in (".1.unfinished.blend", "mine.blend"):
            (folder / name).write_bytes(b"a copy")
    link(out / "link", elsewhere)
    if isinstance(line, dict):
        line = {"unfinished": ".1.unfinished.blend", **line}
        named = out.joinpath(str(line["file"])).parent / str(line["unfinished"])
        # It names what is there, so that its stamp is right.
        line["written"] = stamp(named if named.exists() else out / ".1.unfinished.blend")
    (out / NAME).write_text(json.dumps(line) + "\n")
    before = sorted(tmp_path.rglob("*"))
    with Journal(out) as journal:
        journal.recover()
        assert journal.latest == {}
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [
        ("tree/**/*.blend", ["a.blend", "sub/b.blend", "sub/deep/c.blend"]),
        ("tree/**/c.blend", ["sub/deep/c.blend"]),
        ("tree/**/deep/**/*.blend", ["sub/deep/c.blend"]),
        ("tree/*/**/*.blend", ["sub/b.blend", "sub/deep/c.blend"]),
        ("tree/**/.hidden/*.blend", [".hidden/d.blend"]),
        ("tree/**", ["a.blend", "sub/b.blend", "sub/deep/c.blend"]),
        ("tree/s*/**/[bc].blend", ["sub/b.blend", "sub/deep/c.blend"]),
    ],
)
def test_patterns_with_circular_links_end(tmp_path, monkeypatch, pattern, expected):
    """With two such links, glob would need 2 ** 40 steps."""
    for name in ("a.blend", "sub/b.blend", "sub/deep/c.blend", ".hidden/d.blend"):
        (tmp_path / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "tree" / name).touch()
    monkeypatch.chdir(tmp_path)
    found = {Path(path) for path in glob.glob(pattern, recursive=True) if Path(path).is_file()}
    assert found == {Path("tree") / name for name in expected}
    link(tmp_path / "tree" / "round", ".")
    link(tmp_path / "tree" / "sub" / "up", "..")
    jobs = plan_jobs([pattern], tmp_path / "out")
    assert sorted(job.source.relative_to(tmp_path / "tree").as_posix() for job in jobs) == expected


def test_a_list_separated_by_zeros(tmp_path):
    with pytest.raises(WrongUse, match="not separated by zeros"):
        plan_jobs(["-"], tmp_path / "out", ["a.blend\0b.blend\0"])
