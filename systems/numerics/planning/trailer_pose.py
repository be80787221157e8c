"""Where the trailer is, behind its tractor."""

import numpy as np

from .trailer import Trailer


def trailer_pose(x, y, theta, beta, trailer: Trailer):
    """The trailer's axle and heading: x, y [m], [m] and theta - beta [rad].

    Scalars or arrays of any kind that NumPy's sine takes.
    """
    heading = theta - beta
    behind, length = trailer.hitch_offset, trailer.length
    axle_x = x - behind * np.cos(theta) - length * np.cos(heading)
    axle_y = y - behind * np.sin(theta) - length * np.sin(heading)
    return axle_x, axle_y, heading
