"""What an audit says of a harvest in which much is wrong is as it was recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.crop import crop_record, ground_of
from sightfield.systems.numerics.harvest.audit.harvest_log import read_harvest
from sightfield.systems.numerics.harvest.audit.motion import machines_in_motion, motion_of
from sightfield.systems.numerics.harvest.audit.nearness import nearness


def swerving(shapes, time):
    """A cart that drives over the field in bends, standing at first, and its trailer."""
    way = 2.1 * np.maximum(time - 61.3, 0.0)
    heading = 0.7 + 0.9 * np.sin(way / 17.0)
    step = np.diff(way, prepend=0.0)
    x = 31.7 + np.cumsum(step * np.cos(heading))
    y = -11.9 + np.cumsum(step * np.sin(heading))
    tractor = np.column_stack([x, y, heading])
    return tractor[:, None], shapes.behind(tractor, 0.31)[:, None]


@pytest.fixture
def astray(by_hand, shapes, tmp_path):
    """Two combines and two carts, of which the second ones go astray; a pond, a ditch, yields."""
    log, about = by_hand.log, by_hand.about
    time = log["time"]
    back = np.maximum(np.arange(len(time)) - 157, 0)
    other = log["combine_pose"][back] + np.array([3.7, 16.9, 0.0])
    other[900:, 0, 0] += 0.43
    log["combine_pose"] = np.concatenate([log["combine_pose"], other], axis=1)
    speed = log["combine_speed"][back] * np.where(time > 333.3, 0.83, 1.0)[:, None]
    log["combine_speed"] = np.concatenate([log["combine_speed"], speed], axis=1)
    log["cutting"] = np.concatenate([log["cutting"], log["cutting"][back]], axis=1)
    near = np.broadcast_to([233.1, 8.3, np.pi + 0.2], (len(time), 3))
    log["tractor_pose"] = near[:, None]
    log["trailer_pose"] = shapes.behind(near, 0.5)[:, None]
    tractor, trailer = swerving(shapes, time)
    trailer[700:760, 0, 1] += 0.07
    log["tractor_pose"] = np.concatenate([log["tractor_pose"], tractor], axis=1)
    log["trailer_pose"] = np.concatenate([log["trailer_pose"], trailer], axis=1)
    log["tank"] = np.concatenate([log["tank"], 0.6 * log["tank"][back]], axis=1)
    load = np.interp(time, [100.0, 140.0, 260.0, 270.0], [-0.2, 510.0, 505.0, 90.0])
    log["cart_load"] = np.concatenate([log["cart_load"], load[:, None]], axis=1)
    log["delivered"] = np.interp(time, [260, 270, 300, 301, 497, 498], [0, 415, 415, 402, 402, 405])
    about["combines"].append(
        {**about["combines"][0], "capacity": 700.0, "turning_radius": 6.5, "acceleration": 0.41}
    )
    about["carts"].append(
        {**about["carts"][0], "capacity": 500.0, "lateral_acceleration": 0.17, "acceleration": 0.6}
    )
    corners = [[0, 0], [200, 3.1], [197.3, 46.2], [1.7, 41.9]]
    pond = [[120.3, 22.1], [131.2, 24.4], [127.7, 30.6]]
    ditch = [[-9.0, 10.0], [-3.1, 11.2], [-3.3, 14.0], [-9.0, 14.3]]
    about["parts"] = [{"boundary": corners, "holes": [pond], "no_go": [ditch]}]
    about["margin"] = 41.3
    about["yields"] = {
        "corner": [-2.0, 5.0],
        "side": 61.0,
        "values": [[0.5, 0.9, 0.7, 0.6], [0.8, 0.4, 1.1, 0.3]],
    }
    return read_harvest(by_hand.write(tmp_path))


def test_all_that_is_wrong_is_told_as_recorded(astray, as_recorded):
    log, site = astray
    found = audit_harvest(log, site, 0.47)
    kinds = {fault.kind for fault in found.faults}
    assert {"machines too near", "machines overlap", "in an obstacle", "crop under bodies"} <= kinds
    assert {"beyond the margin", "grain is lost", "turn"} <= kinds
    as_recorded([found.figures, found.faults], relative=1e-4, absolute=1e-4)


def test_what_becomes_of_the_crop_is_as_recorded(astray, as_recorded):
    log, site = astray
    ground = ground_of(site)
    crop = crop_record(log, site, ground.crop)
    as_recorded(
        {
            "area": crop.area,
            "side": crop.side,
            "cut": crop.cut[::150],
            "grain": crop.grain[::150],
            "crushed": {name: [c.sum(), np.flatnonzero(c)] for name, c in crop.crushed.items()},
            "ground": [g.area for g in (ground.crop, ground.obstacles, ground.allowed)],
            "touched": [ground.core.area, ground.touched.area],
        }
    )


def test_how_machines_move_is_as_recorded(astray, as_recorded):
    log, site = astray
    moving = machines_in_motion(log, site)
    as_recorded({name: [[o.points, o.reach] for o in each] for name, each in moving.items()})
    as_recorded(
        [motion_of(log.tractor_pose[:, 1], log.time), motion_of(log.combine_pose[:, 1], log.time)],
        "motion",
    )
    outlines = [o for each in moving.values() for o in each]
    pairs = [(a, b) for n, a in enumerate(outlines) for b in outlines[:n] if a.machine != b.machine]
    # One that is far from all others is ruled out by circles; with no bound all are found.
    found = [nearness(a, b, 0.47, best) for a, b in pairs for best in (np.inf, 3.0)]
    as_recorded([[np.isfinite(n.least).sum(), n.nearest] for n in found], "near", absolute=1e-5)
