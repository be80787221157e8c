"""Where the coloured shells of other robots are, from pictures alone."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem, ValueProducer
from pydrake.systems.sensors import ImageRgba8U

from ..drake_parts import AbstractValue, read
from ..numerics.errors import require_one_of
from ..numerics.vision.estimation.calibration import Calibration
from ..numerics.vision.estimation.range_models import MODELS
from ..numerics.vision.estimation.shell_detection import chosen_colours
from ..numerics.vision.estimation.shell_estimate import ShellEstimate, locate, search_shells


class ShellEstimator(LeafSystem):
    """Finds one shell of each colour in a picture and says where it is, and how surely.

    With p the distance of the shell's bottom edge from the mirror's axis in the picture and alpha
    its bearing there, the range is d = h tan(p / k) (thesis), or where the exact ray at p meets
    the height of that edge (exact). The shell's axis is rho, its radius, further off:

        theta_e = theta_p + alpha,  x_e = x_p + (d + rho) cos theta_e,
                                    y_e = y_p + (d + rho) sin theta_e.

    .. pydrake_system::

        name: ShellEstimator
        input_ports:
        - image
        - pose
        output_ports:
        - position
        - covariance
        - valid
        - range_bearing
        - outcome

    =============  ===========  =========  =======  ===========
    port           size         unit       frame    feedthrough
    =============  ===========  =========  =======  ===========
    image          ImageRgba8U  -          picture  -
    pose           3            m, m, rad  world    -
    position       2 N          m          world    all
    covariance     4 N          m^2        world    all
    valid          N            -          -        image
    range_bearing  2 N          m, rad     robot    image
    outcome        N            -          -        image
    =============  ===========  =========  =======  ===========

    `pose` is the camera's when the picture was taken. Covariances are 2 x 2, row by row. `valid`
    is 1 where there is an estimate, else 0, and then position and range_bearing are NaN and the
    covariance's diagonal is infinite. `outcome` is the number of an `Outcome`, which says why.
    Range and bearing are of the shell's near side.

    No state: one picture, one estimate. A picture that is one colour all over, as before the
    first, gives none.

    Source: Zhang 2014, (2.4)-(2.6). There (2.6) takes the range to the shell's side for that to
    its middle; refusals and covariances are ours.

    Args:
        calibration: Of the camera and the shells.
        colours: Names of the N colours, in the order of the outputs.
        model: Of the range, one of MODELS.

    Raises:
        InvalidInput: An unknown colour or model, or a colour that comes twice. When running: a
            picture of another size than the calibrated camera's.
    """

    def __init__(self, calibration: Calibration, colours: Sequence[str], *, model: str = "exact"):
        super().__init__()
        require_one_of("model", model, MODELS)
        self._colours = chosen_colours(colours)
        self._calibration, self._model = calibration, model
        count, camera = len(self._colours), calibration.camera
        self._image = self.DeclareAbstractInputPort(
            "image", AbstractValue.Make(ImageRgba8U(camera.width, camera.height))
        )
        self._pose = self.DeclareVectorInputPort("pose", 3)
        # Looked for once in each picture, whichever outputs are asked for, wherever the robot is.
        self._search = self.DeclareCacheEntry(
            "search",
            ValueProducer(allocate=lambda: AbstractValue.Make([]), calc=self._calc_search),
            {self._image.ticket()},
        )
        picture, placed = {self._image.ticket()}, {self._image.ticket(), self._pose.ticket()}
        for name, size, calc, sources in (
            ("position", 2, self._calc_position, placed),
            ("covariance", 4, self._calc_covariance, placed),
            ("valid", 1, self._calc_valid, picture),
            ("range_bearing", 2, self._calc_range_bearing, picture),
            ("outcome", 1, self._calc_outcome, picture),
        ):
            self.DeclareVectorOutputPort(name, size * count, calc, prerequisites_of_calc=sources)

    def _calc_search(self, context, value):
        picture = self._image.Eval(context).data  # type: ignore[attr-defined]  # the stubs say object
        found = search_shells(picture, self._colours, self._calibration, self._model)
        value.set_value([estimate for _, estimate in found])

    def _estimates(self, context) -> list[ShellEstimate]:
        return self._search.Eval(context)  # type: ignore[return-value]  # the stubs say object

    def _located(self, context):
        pose, radius = read(self._pose, context), self._calibration.shell_radius
        return [locate(each, pose, radius) for each in self._estimates(context)]

    def _calc_position(self, context, output):
        output.set_value(np.concatenate([position for position, _ in self._located(context)]))

    def _calc_covariance(self, context, output):
        output.set_value(np.concatenate([spread.ravel() for _, spread in self._located(context)]))

    def _calc_valid(self, context, output):
        output.set_value([float(e.outcome.has_estimate) for e in self._estimates(context)])

    def _calc_range_bearing(self, context, output):
        output.set_value(np.ravel([(e.range, e.bearing) for e in self._estimates(context)]))

    def _calc_outcome(self, context, output):
        output.set_value([float(each.outcome) for each in self._estimates(context)])
