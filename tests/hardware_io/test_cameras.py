"""Pictures of folders and of what OpenCV opens, as a port."""

import time

import cv2
import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.hardware_io.cameras import CameraPort, Frame, NoCamera, OpenCvCapture, PictureFolder
from sightfield.systems.numerics.errors import InvalidInput


class Clock:
    """A clock that a test sets."""

    now = 10.0

    def __call__(self):
        return self.now


@pytest.fixture
def folder(tmp_path):
    """Three pictures, red, green, blue, and a file that is none."""
    for number, colour in enumerate([(0, 0, 255), (0, 255, 0), (255, 0, 0)]):
        picture = np.full((4, 6, 3), colour, dtype=np.uint8)
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture)
    (tmp_path / "notes.txt").write_text("no picture")
    return tmp_path


def test_a_folder_is_shown_in_order_and_its_last_picture_grows_old(folder):
    clock = Clock()
    source = PictureFolder(folder, rate=10.0, clock=clock)
    colours, stamps = [], []
    for _ in range(5):
        frame = source.read()
        assert frame is not None
        colours.append(frame.picture[0, 0].tolist())
        stamps.append(frame.stamp)
        clock.now += 0.1
    red, green, blue = [255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]
    assert colours == [red, green, blue, blue, blue]
    assert stamps == pytest.approx([10, 10.1, 10.2, 10.2, 10.2])


def test_a_folder_without_pictures_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="be a folder that holds pictures"):
        PictureFolder(tmp_path)
    (tmp_path / "a.png").write_text("no picture")
    with pytest.raises(InvalidInput, match="must hold pictures that can be read; got"):
        PictureFolder(tmp_path)


def test_what_opencv_opens_is_read(tmp_path):
    path = str(tmp_path / "film.avi")
    film = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
    for _ in range(10):
        film.write(np.full((48, 64, 3), (0, 0, 255), dtype=np.uint8))
    film.release()
    source = OpenCvCapture(path)
    deadline = time.monotonic() + 5
    while source.read() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    frame = source.read()
    source.close()
    assert frame is not None
    assert frame.picture.shape == (48, 64, 4)
    # Red, but for what the coder loses.
    assert np.abs(frame.picture[24, 32].astype(int) - [255, 0, 0, 255]).max() < 8


def test_a_camera_that_is_not_there_is_refused_in_one_line(capfd):
    with pytest.raises(InvalidInput, match="a camera that OpenCV can open; got 77") as error:
        OpenCvCapture("77")
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def look(port, simulator):
    context = simulator.get_context()
    image = port.GetOutputPort("image").Eval(context)
    values = [port.GetOutputPort(name).Eval(context)[0] for name in ("valid", "age", "stamp")]
    return image.data[0, 0].tolist(), values


def test_a_port_holds_the_newest_picture_until_it_is_stale():
    clock = Clock()

    class Camera:
        """A camera whose picture is its number."""

        frame = None

        def read(self):
            return self.frame

        def close(self):
            """Nothing is held."""

    camera = Camera()
    port = CameraPort(camera, period=0.1, stale_after=0.25, clock=clock)
    simulator = Simulator(port)
    simulator.AdvanceTo(0.05)
    assert look(port, simulator) == ([0, 0, 0, 255], [0, np.inf, -np.inf])
    camera.frame = Frame(np.full((2, 2, 4), 9, dtype=np.uint8), clock.now - 0.02)
    simulator.AdvanceTo(0.15)
    picture, times = look(port, simulator)
    assert picture == [9] * 4
    assert times == pytest.approx([1, 0.02, 0.08])
    clock.now += 0.3
    simulator.AdvanceTo(0.25)
    picture, times = look(port, simulator)
    assert picture == [9] * 4
    assert times == pytest.approx([0, 0.32, -0.12])


def test_without_a_camera_the_picture_is_black_and_not_valid():
    port = CameraPort(NoCamera(), period=0.1, stale_after=0.5)
    simulator = Simulator(port)
    simulator.AdvanceTo(1.0)
    assert look(port, simulator)[0] == [0, 0, 0, 255]
    assert look(port, simulator)[1][0] == 0
