"""The campaign that every kind has to pass: ours do, and a fault of a kind fails it."""

import json
import sys
from contextlib import contextmanager
from dataclasses import replace

import pytest

from sightfield.diagrams.commands.app import main
from sightfield.diagrams.station.kind_check import check_kind
from sightfield.hardware_io.emulation.stand_in_laboratory import DatagramWire, StandInLaboratory
from sightfield.hardware_io.kinds.known_kinds import KINDS, UDP
from sightfield.hardware_io.kinds.robot_kind import LATE
from sightfield.hardware_io.kinds.udp_board import UdpBoard
from sightfield.hardware_io.kinds.udp_link import UdpLink


@pytest.mark.parametrize("name", [name for name in KINDS if name != "xbee"])
def test_every_kind_passes(name):
    # One that waits for seconds is tried with a shorter silence, of its robots too.
    kind = replace(KINDS[name], silence=min(KINDS[name].stops_after, 0.25))
    found = list(check_kind(kind))
    assert len(found) == 13
    assert [each for each in found if not each.passed] == []


def test_the_firmware_passes_what_its_own_tests_do_not_try(require_tool):
    require_tool("avr-gcc", "gcc-avr avr-libc libsimavr-dev")
    names = ["late messages", "repeated messages", "reordered messages"]
    assert [each.passed for each in check_kind(KINDS["xbee"], names)] == [True] * 3


class Repeating(UdpBoard):
    """Says everything twice."""

    def reports(self, now, sensed):
        return 2 * super().reports(now, sensed)


def kind_with(board):
    @contextmanager
    def stand_in(fleet, around):
        wire = DatagramWire(len(fleet.robots))
        with StandInLaboratory(
            fleet.robots,
            around.starts,
            lambda k: board(fleet.robots[k], around.silence, boot=k),
            wire,
            air=around.air,
        ) as laboratory:
            yield laboratory, replace(fleet, addresses=wire.addresses)

    return replace(UDP, stand_in=stand_in)


@pytest.mark.parametrize(
    ("board", "trial"),
    [
        ("Runaway", "silence"),
        ("Forgetful", "repeated messages"),
        ("Forgetful", "reordered messages"),
        ("Timeless", "late messages"),
        ("Stubborn", "stop"),
        ("Mute", "armed"),
        ("Reversed", "armed"),
    ],
)
def test_robots_that_do_not_do_what_they_have_to_fail(monkeypatch, ill_board, board, trial):
    monkeypatch.setattr("sightfield.diagrams.station.kind_check._PATIENCE", 0.7)
    (found,) = check_kind(kind_with(ill_board(board)), [trial])
    assert not found.passed, found


def test_robots_may_follow_late_messages_if_their_kind_says_so(ill_board):
    honest = replace(kind_with(ill_board("Timeless")), recognises=UDP.recognises - {LATE})
    (found,) = check_kind(honest, ["late messages"])
    assert found.passed
    assert "robots need not see that" in found.words


def test_reports_that_come_twice_count_once():
    link = []

    def kept(fleet):
        link.append(UdpLink(fleet.robots, fleet.addresses))
        return link[-1]

    (found,) = check_kind(replace(kind_with(Repeating), link=kept), ["armed"])
    assert found.passed
    health = link[0].health()
    assert health.received > 0
    # One may be under way yet.
    assert health.refused == pytest.approx(health.received, abs=2)


def test_the_command_tells_each_trial_and_fails_with_one(monkeypatch, capsys, tmp_path):
    (tmp_path / "silent_robots.py").write_text(
        "from dataclasses import replace\n"
        "from sightfield.hardware_io.kinds.known_kinds import UDP\n"
        "SILENT = replace(UDP, silence=None)\n"
    )
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["sightfield", "station", "kind-check", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, *capsys.readouterr()

    monkeypatch.setattr(
        "sightfield.diagrams.station.kind_check._Trials.all",
        lambda trials: [("not armed", trials._not_armed), ("armed", trials._stop)],
    )
    code, said, _ = run("udp", "--json")
    answer = json.loads(said)
    assert (code, answer["kind"], answer["silence"]) == (0, "udp", 0.2)
    assert answer["recognises"] == ["late", "reordered", "repeated"]
    assert [each["name"] for each in answer["trials"]] == ["not armed", "armed"]
    for name, words in (
        ("carrier-pigeon", "`radio.kind` must be one of"),
        ("silent_robots:SILENT", "`silence` must say after what time"),
        ("json:NOTHING", "`radio.kind` must be a module and a name in it"),
    ):
        code, said, error = run(name)
        assert (code, said, error.count("\n")) == (2, "", 1), name
        assert words in error
