"""What `sightfield plan` says, draws and shows is as it was recorded."""

import pytest


@pytest.mark.parametrize(
    "words",
    [
        "--start 0.3 0.2 0.4 -0.3 --goal 3 2.5 0.5 0.2 --grid 0.5 --hitch-offset 0.1 --length 0.9",
    ],
)
def test_a_plan_is_as_recorded(
    words, sightfield_here, tmp_path, as_recorded, saved_pictures, meshcat_calls
):
    done = sightfield_here("plan", *words.split(), "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    as_recorded(saved_pictures["paths.png"], "paths", relative=1e-4, absolute=1e-5)
    as_recorded(meshcat_calls, "scene", relative=1e-4, absolute=1e-6)
    as_recorded(sorted(each.name for each in (tmp_path / "out").iterdir()), "files")
