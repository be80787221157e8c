"""Files are read whole and never without end, written whole or not at all; YAML says all it has."""

import os

import pytest
import yaml

from sightfield.systems.numerics import files
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.files import read_input, read_yaml, written_whole


def test_what_is_in_a_file_is_read(tmp_path):
    (tmp_path / "given").write_bytes(b"\0all of it\n")
    assert read_input("map", tmp_path / "given") == b"\0all of it\n"


def test_what_cannot_be_read_whole_is_refused_by_its_name(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MOST_BYTES", 4)
    pipe, large, full = tmp_path / "pipe", tmp_path / "large", tmp_path / "full"
    os.mkfifo(pipe)
    full.write_bytes(b"1234")
    large.write_bytes(b"12345")
    assert read_input("map", full) == b"1234"
    for path, says in (
        (pipe, "`map` must be a file"),
        (tmp_path, "`map` must be a file"),
        (large, "`map` must have at most 4 bytes; got .*large, which has 5"),
        (tmp_path / "none", r"`map` must be readable; got .*none \(No such file or directory\)"),
        ("nul\0", "`map` must be readable"),
    ):
        with pytest.raises(InvalidInput, match=says):
            read_input("map", path)


def be_interrupted_in(path):
    with written_whole(path) as file:
        file.write(b"half of the sec")
        raise KeyboardInterrupt


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "table"
    with written_whole(path) as file:
        file.write(b"first")
        assert not path.exists()
    with pytest.raises(KeyboardInterrupt):
        be_interrupted_in(path)
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]


def test_where_nothing_can_be_written_is_refused(tmp_path):
    for path, says in (
        (tmp_path, "`path` must be a file"),
        (tmp_path / "none" / "table", "`path` must be in a folder that exists"),
    ):
        with pytest.raises(InvalidInput, match=says), written_whole(path):
            pass


def test_yaml_is_read_and_may_merge_what_it_says_elsewhere():
    assert read_yaml("a: {b: 1, c: 2}") == {"a": {"b": 1, "c": 2}}
    merged = read_yaml("one: &one {b: 1, c: 2}\nother: {<<: *one, c: 3}")
    assert merged["other"] == {"b": 1, "c": 3}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 1\nb: 2\na: 3", "line 1 and line 3 both say `a`"),
        ("a: 2020-99-99", "a number, date or truth value is none"),
        ("[" * 5000, "nested too deep"),
        ("a: [", "while parsing"),
    ],
)
def test_what_is_no_yaml_is_refused(text, says):
    with pytest.raises(yaml.YAMLError, match=says):
        read_yaml(text)
