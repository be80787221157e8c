"""A page with sliders on which one turns a stand-off loop's gains and sees what they do."""

import time
from dataclasses import replace

import numpy as np
from pydrake.geometry import Meshcat, Rgba

from ..visuals.picture_square import picture_square
from .pictures.laboratory_picture import laboratory_image
from .scenario import StandoffScenario

ROOT = "/laboratory"
STOP = "Stop"
KP, KI, KD, DELAY = "K_P [1/s]", "K_I [1/s^2]", "K_D [1]", "delay [samples]"
# Name, least, largest and step of each slider.
_SLIDERS = ((KP, 0.5, 60.0, 0.5), (KI, 0.1, 200.0, 0.1), (KD, 0.0, 3.0, 0.05), (DELAY, 0, 40, 1))
_PIXELS = 1400
# How often the sliders are read [s].
_PAUSE = 0.05


class StandoffPage:
    """The page: sliders, and a picture that follows them.

    Attributes:
        meshcat: Where it is.
        scenario: What is shown now.
    """

    def __init__(self, meshcat: Meshcat, scenario: StandoffScenario) -> None:
        """Put sliders and picture on a page.

        Args:
            meshcat: The page.
            scenario: What to begin with; values beyond a slider's ends are moved to them.
        """
        self.meshcat = meshcat
        loop = scenario.loop
        values = {KP: loop.kp, KI: loop.ki, KD: loop.kd, DELAY: scenario.delay_samples}
        for name, least, largest, step in _SLIDERS:
            value = min(max(values[name], least), largest)
            meshcat.AddSlider(name, least, largest, step, value)
        meshcat.AddButton(STOP)
        # Of a perspective camera's picture a page of another shape keeps the middle.
        meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=16.0, aspect=16 / 9, near=0.01, far=20.0))
        # The open controls lie to the right of the picture.
        eye, centre = np.array([0.24, -1e-3, 5.0]), np.array([0.24, 0.0, 0.0])
        # Drake's stubs put the dtype of an array where its shape belongs.
        meshcat.SetCameraPose(eye, centre)  # pyright: ignore[reportArgumentType]
        for part in ("/Grid", "/Axes"):
            meshcat.SetProperty(part, "visible", False)
        for end in ("top_color", "bottom_color"):
            meshcat.SetProperty("/Background", end, [0.88, 0.88, 0.88])
        self.scenario = self._asked(scenario)
        self._draw()

    def update(self) -> bool:
        """Draw again if a slider has moved; whether it has."""
        asked = self._asked(self.scenario)
        if asked == self.scenario:
            return False
        self.scenario = asked
        self._draw()
        return True

    def serve(self, seconds: float | None = None) -> None:
        """Follow the sliders until the button is pressed.

        Args:
            seconds: At most so long [s]; None: for ever.
        """
        end = None if seconds is None else time.monotonic() + seconds
        while self.meshcat.GetButtonClicks(STOP) == 0:
            if end is not None and time.monotonic() > end:
                break
            if not self.update():
                time.sleep(_PAUSE)

    def _asked(self, scenario: StandoffScenario) -> StandoffScenario:
        kp, ki, kd, delay = (self.meshcat.GetSliderValue(name) for name, *_ in _SLIDERS)
        loop = replace(scenario.loop, kp=kp, ki=ki, kd=kd)
        return replace(scenario, loop=loop, delay_samples=round(delay))

    def _draw(self) -> None:
        square = picture_square(laboratory_image(self.scenario), 2.0, pixels=_PIXELS)
        self.meshcat.SetObject(f"{ROOT}/picture", square, Rgba(1, 1, 1, 1))
