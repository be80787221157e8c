"""A folder of results is complete, or as it was before."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from sightfield.diagrams.outputs import MANIFEST, NoRoom, new_files, output_folder
from sightfield.systems.numerics.errors import InvalidInput


def contents(folder: Path) -> dict[str, str]:
    """Text of every file below a folder but for lists of what runs have written."""
    return {
        str(file.relative_to(folder)): file.read_text(encoding="utf-8")
        for file in folder.rglob("*")
        if file.is_file() and file.name != MANIFEST
    }


def write_results(out: Path, **texts: str) -> None:
    """Have a run leave files, whose names are said without their suffix."""
    with output_folder(out) as folder:
        for name, text in texts.items():
            file = folder / name.replace("__", "/")
            file.parent.mkdir(exist_ok=True)
            file.with_suffix(".txt").write_text(text, encoding="utf-8")


def test_files_arrive_together_at_the_end(tmp_path):
    out = tmp_path / "results"
    with output_folder(out) as folder:
        (folder / "a.txt").write_text("a", encoding="utf-8")
        (folder / "plots").mkdir()
        (folder / "plots" / "b.txt").write_text("b", encoding="utf-8")
        assert not out.exists()
    assert contents(tmp_path) == {"results/a.txt": "a", "results/plots/b.txt": "b"}
    assert os.listdir(tmp_path) == ["results"]


def test_an_option_is_not_taken_for_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInput, match="`out` must not begin with --; got --help"):
        output_folder(Path("--help")).__enter__()
    assert os.listdir(tmp_path) == []


def test_missing_parents_are_made(tmp_path):
    with output_folder(tmp_path / "one" / "two") as folder:
        (folder / "a.txt").write_text("a", encoding="utf-8")
    assert contents(tmp_path) == {"one/two/a.txt": "a"}


def test_a_relative_path_is_meant_from_where_one_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with output_folder("results") as folder:
        (folder / "a.txt").write_text("a", encoding="utf-8")
    assert contents(tmp_path) == {"results/a.txt": "a"}


def test_files_of_the_same_name_are_replaced_and_others_left(tmp_path):
    (tmp_path / "a.txt").write_text("old", encoding="utf-8")
    (tmp_path / "b.txt").write_text("old", encoding="utf-8")
    with output_folder(tmp_path) as folder:
        (folder / "a.txt").write_text("new", encoding="utf-8")
        assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "old"
    assert contents(tmp_path) == {"a.txt": "new", "b.txt": "old"}


@pytest.mark.parametrize("there", [True, False])
def test_after_a_failure_nothing_has_changed(tmp_path, there):
    out = tmp_path / "one" / "two" if not there else tmp_path
    (tmp_path / "a.txt").write_text("old", encoding="utf-8")

    def fail():
        with output_folder(out) as folder:
            (folder / "a.txt").write_text("new", encoding="utf-8")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert contents(tmp_path) == {"a.txt": "old"}
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_file_is_no_folder_and_that_is_said_before_the_work_begins(tmp_path):
    (tmp_path / "file").write_text("kept", encoding="utf-8")
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InvalidInput, match=r"`out` must be a writable folder; got .*file"):
            output_folder(out).__enter__()
    assert contents(tmp_path) == {"file": "kept"}


def test_a_run_takes_the_place_of_the_one_before(tmp_path):
    write_results(tmp_path, summary="1", replay="1", pictures__a="1", pictures__b="1")
    write_results(tmp_path, summary="2", pictures__a="1")
    assert contents(tmp_path) == {"summary.txt": "2", "pictures/a.txt": "1"}
    write_results(tmp_path, summary="3")
    assert contents(tmp_path) == {"summary.txt": "3"}
    assert not (tmp_path / "pictures").exists()


def test_what_a_user_put_into_a_folder_of_results_or_changed_there_is_left_alone(tmp_path):
    write_results(tmp_path, summary="1", notes="1", replay="1", pictures__a="1")
    (tmp_path / "notes.txt").write_text("1, and what I think of it", encoding="utf-8")
    (tmp_path / "pictures" / "mine.txt").write_text("mine", encoding="utf-8")
    (tmp_path / "replay.txt").unlink()
    write_results(tmp_path, summary="2")
    kept = {"notes.txt": "1, and what I think of it", "pictures/mine.txt": "mine"}
    assert contents(tmp_path) == {"summary.txt": "2", **kept}


def test_results_of_runs_that_lose_nothing_to_another_stay_beside_it(tmp_path):
    write_results(tmp_path, picture="1", camera="1")
    write_results(tmp_path, estimate="1", summary="1")
    assert len(contents(tmp_path)) == 4
    write_results(tmp_path, picture="2")
    assert contents(tmp_path) == {"picture.txt": "2", "estimate.txt": "1", "summary.txt": "1"}


def test_a_run_that_fails_leaves_the_one_before_as_it_was(tmp_path):
    write_results(tmp_path, a="1", replay="1")

    def fail(folder):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_within(tmp_path, fail)
    assert contents(tmp_path) == {"a.txt": "1", "replay.txt": "1"}


@pytest.mark.parametrize("name", ["../outside.txt", "link/outside.txt", "{}/outside.txt"])
def test_a_list_from_elsewhere_deletes_nothing_outside_of_the_folder(tmp_path, name):
    out, outside = tmp_path / "out", tmp_path / "outside.txt"
    write_results(out, summary="1")
    outside.write_text("1", encoding="utf-8")
    (out / "link").symlink_to(tmp_path)
    (run,) = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
    run[name.format(tmp_path)] = run["summary.txt"]
    (out / MANIFEST).write_text(json.dumps([run]), encoding="utf-8")
    write_results(out, summary="2")
    assert outside.read_text(encoding="utf-8") == "1"


@pytest.mark.parametrize("text", ["", "{", "7", "[7]", '[{"replay.txt": 7}]', '{"replay.txt": ""}'])
def test_a_list_that_is_none_deletes_nothing(tmp_path, text):
    write_results(tmp_path, summary="1", replay="1")
    (tmp_path / MANIFEST).write_text(text, encoding="utf-8")
    write_results(tmp_path, summary="2")
    assert contents(tmp_path) == {"summary.txt": "2", "replay.txt": "1"}


def test_new_files_take_the_place_of_no_run(tmp_path):
    write_results(tmp_path, summary="1", replay="1")
    with new_files(tmp_path) as folder:
        (folder / "summary.txt").write_text("2", encoding="utf-8")
    assert contents(tmp_path) == {"summary.txt": "2", "replay.txt": "1"}


def test_a_folder_in_the_way_of_a_file_stops_the_move_before_it_begins(tmp_path):
    (tmp_path / "b.txt").mkdir()

    def write():
        with output_folder(tmp_path) as folder:
            (folder / "a.txt").write_text("new", encoding="utf-8")
            (folder / "b.txt").write_text("new", encoding="utf-8")

    with pytest.raises(InvalidInput, match=r"`out` must not have a folder named b\.txt"):
        write()
    assert os.listdir(tmp_path) == ["b.txt"]


def test_others_may_read_the_results_as_far_as_the_user_lets_them(tmp_path):
    with output_folder(tmp_path / "results") as folder:
        (folder / "a.txt").write_text("a", encoding="utf-8")
    plain = tmp_path / "plain"
    plain.mkdir()
    # The temporary folder is private; the results are not.
    assert (tmp_path / "results").stat().st_mode == plain.stat().st_mode


def fail_within(out: Path, act: Callable[[Path], None]) -> None:
    """Write a file into a folder of results, then do something that fails."""
    with output_folder(out) as folder:
        (folder / "a.txt").write_text("a", encoding="utf-8")
        act(folder)


def no_room(folder: Path) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def not_writable(folder: Path) -> None:
    (folder / "gone" / "b.txt").write_text("b", encoding="utf-8")


def radio_is_silent(folder: Path) -> None:
    raise OSError(errno.EIO, os.strerror(errno.EIO), "/dev/ttyUSB0")


def test_a_full_disk_and_a_file_that_cannot_be_written_are_named_by_the_folder_asked_for(tmp_path):
    out = tmp_path / "results"
    with pytest.raises(NoRoom) as full:
        fail_within(out, no_room)
    assert str(full.value) == (
        f"`out` must have room for the results; got {out} (No space left on device)"
    )
    with pytest.raises(InvalidInput) as refused:
        fail_within(out, not_writable)
    assert not isinstance(refused.value, NoRoom)
    assert str(refused.value) == (
        f"`out` must be a writable folder; got {out} (No such file or directory)"
    )
    assert os.listdir(tmp_path) == []


def test_what_fails_elsewhere_while_results_are_made_is_not_blamed_on_the_folder(tmp_path):
    with pytest.raises(OSError, match="ttyUSB0") as broken:
        fail_within(tmp_path / "results", radio_is_silent)
    assert broken.value.errno == errno.EIO
    assert os.listdir(tmp_path) == []
