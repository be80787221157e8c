"""`sightfield harvest audit` as a user meets it."""

import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import main, make_app

BOX = [[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]]


@pytest.fixture
def folder(tmp_path):
    """Two combines drive past each other, 0.5 m apart, on a field without a cart."""
    time = np.arange(0.0, 20.5, 0.5)
    ways = np.stack([1.5 * time, 30 - 1.5 * time], axis=1)
    poses = np.zeros((len(time), 2, 3))
    poses[..., 0], poses[:, 1, 1], poses[:, 1, 2] = ways, 3.5, np.pi
    rows, none = np.zeros((len(time), 2)), np.zeros((len(time), 0, 3))
    np.savez(
        tmp_path / "log.npz",
        time=time,
        combine_pose=poses,
        combine_speed=rows + 1.5,
        tractor_pose=none,
        trailer_pose=none,
        tank=rows,
        cart_load=none[..., 0],
        cutting=rows,
        delivered=rows[:, 0],
    )
    about = {
        "combines": [{"header": BOX, "body": BOX}] * 2,
        "carts": [],
        # The crop is off their way.
        "parts": [{"boundary": [[-5, 8], [35, 8], [35, 20], [-5, 20]], "holes": []}],
        "margin": 12,
    }
    (tmp_path / "machines.json").write_text(json.dumps(about), encoding="utf-8")
    return tmp_path


@pytest.fixture
def audit(monkeypatch, capsys):
    """A function that runs the command in this process: how it ended and what it printed."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["sightfield", "harvest", "audit", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return SimpleNamespace(code=ended.value.code, out=out, err=err)

    return run


def test_a_log_in_which_nothing_is_wrong_exits_0(audit, folder):
    done = audit(folder)
    assert (done.code, done.err) == (0, "")
    assert "nothing wrong" in done.out
    figures = json.loads(audit(folder, "--json").out)
    assert figures["passed"]
    assert figures["faults"] == []
    assert figures["min_combine_to_combine"] == pytest.approx(0.5, abs=1e-3)
    assert figures["coverage"] == 0.0


def test_a_gap_that_is_not_kept_exits_1_and_is_listed_with_time_machines_and_amount(audit, folder):
    done = audit(folder, "--gap", "0.6")
    assert done.code == 1
    (line,) = [each for each in done.out.splitlines() if "combine 0 and combine 1" in each]
    assert "machines too near; 0.5 m at" in line
    answer = json.loads(audit(folder, "--gap", "0.6", "--json").out)
    (fault,) = answer["faults"]
    assert not answer["passed"]
    assert fault["machines"] == ["combine 0", "combine 1"]
    # They meet at 10 s; boxes 4 m long pass each other at 3 m/s.
    assert fault["begin"] < 10 < fault["end"]
    assert fault["end"] - fault["begin"] == pytest.approx(8 / 3, abs=1.0)
    assert (fault["amount"], fault["limit"], fault["unit"]) == (pytest.approx(0.5), 0.6, "m")


@pytest.mark.parametrize("wrong", ["gap", "folder", "log", "machines"])
def test_bad_input_exits_2_with_one_line(audit, folder, wrong):
    words = [folder]
    if wrong == "gap":
        words += ["--gap", "-1"]
    elif wrong == "folder":
        words = [folder / "none"]
    elif wrong == "log":
        (folder / "log.npz").write_bytes(b"PK\x03\x04 and no more")
    else:
        (folder / "machines.json").write_text("{}", encoding="utf-8")
    done = audit(*words)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: `")
    assert done.err.count("\n") == 1


@pytest.mark.parametrize("words", [["no_such_scenario"], ["run", "no_such_scenario"]])
def test_what_is_no_subcommand_is_a_scenario(words):
    done = CliRunner().invoke(make_app(), ["harvest", *words])
    assert done.exit_code == 1
    assert "no_such_scenario" in str(done.exception)


def test_options_alone_are_those_of_a_run():
    done = CliRunner().invoke(make_app(), ["harvest", "--set", "combines.count=0"])
    assert "count" in str(done.exception)
    help_ = CliRunner().invoke(make_app(), ["harvest", "--help"]).output
    assert "audit" in help_
    assert "run" in help_


def test_an_audit_loads_no_drake(folder, run_program):
    code = (
        "import sys\n"
        f"sys.argv = ['sightfield', 'harvest', 'audit', {str(folder)!r}]\n"
        "from sightfield.diagrams.commands.app import main\n"
        "try:\n    main()\n"
        "except SystemExit as ended:\n    print(ended.code, 'pydrake' in sys.modules)\n"
    )
    assert run_program(sys.executable, "-c", code).splitlines()[-1] == "0 False"
