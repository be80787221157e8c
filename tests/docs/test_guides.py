"""The examples of the guides are complete: typed in as they stand, they do what is said."""

import subprocess
import sys


def test_the_guides_code_runs_and_prints_what_they_say(guide, tmp_path):
    for kind, text in guide.blocks:
        if kind == "yaml" and text.startswith("# "):
            name = text.partition("\n")[0].removeprefix("# ")
            (tmp_path / name).write_text(text, encoding="utf-8")
    code = "\n".join(text for kind, text in guide.blocks if kind == "python")
    said = "".join(text for kind, text in guide.blocks if kind == "text")
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == said


def test_a_kind_of_robots_of_one_s_own_takes_80_lines_at_most(pages):
    (page,) = (page for page in pages if page.name == "guides/robot.md")
    blocks = [text for kind, text in page.blocks if kind == "python"]
    before = blocks[: next(k for k, text in enumerate(blocks) if "check_kind" in text)]
    assert "RobotKind(" in before[-1]
    assert sum(len(text.splitlines()) for text in before) <= 80
