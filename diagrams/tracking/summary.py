"""A tracking run in a few numbers, and in arrays for whoever wants to look closer."""

import numpy as np

from ...systems.numerics.geometry.clearance import clearances
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.tracking.body_gaps import count_contacts, gaps_between_samples, pair_gaps
from .promises import audit_promises
from .run import TrackingRun

# Units of the arrays in the log; "1" for numbers without one.
UNITS = {
    "time": "s",
    "pursuer_position": "m",
    "evader_position": "m",
    "visibility": "1",
    "assignment": "1",
    "pursuer_velocity": "m/s",
    "evader_velocity": "m/s",
    "body_gap": "m",
}
# Of what is logged where the solved visibility game is looked up.
CERTIFICATE_UNITS = {"certificate": "s", "guaranteed_time": "s", "withdrawn": "1"}


def summarise_tracking(run: TrackingRun, scenario: str) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Args:
        run: A finished run.
        scenario: What to call it.

    Returns:
        scenario, seed, pursuers, evaders (team sizes), seconds (horizon) [s], period [s],
        tracking_time (until some evader is seen by nobody; the end of the run if never) [s],
        censored (whether the run ended first), lost_evader (number or None), assignment_changes
        (a pursuer's change of evader from one sample to the next), min_clearance (least distance
        of a robot's centre from a true obstacle) [m], min_body_gap (least gap of two bodies, at
        samples and between them, negative where they overlap; None with a single robot) [m],
        contacts (how often two bodies came to overlap), bodies (whether robots keep off one
        another), robot_radius (of the pursuers), evader_radius [m], commands_reversed (a
        pursuer's desired velocity turned by more than a right angle from one sample to the next),
        wall_time [s], realtime_factor. Where the solved visibility game is looked up also
        certificate: for how long all evaders could be kept in sight at the start, None for ever
        [s]; certified, whether that was by the lower bound; and certificate_withdrawn: how often a
        pursuer's promise was withdrawn because it was deflected; broken_promise: the first promise
        that was not kept though it stood, in words, empty where all were. The latter two are None
        where it was by the middle bound.
    """
    game, log = run.game, run.log
    centres = np.concatenate([log["pursuer_position"], log["evader_position"]], axis=1)
    gaps = clearances(build_edge_index(game.world), centres.reshape(-1, 2))
    bodies = gaps_between_samples(centres, game.radii)
    wishes = log["pursuer_velocity"]
    reversals = (np.einsum("tik,tik->ti", wishes[1:], wishes[:-1]) < 0).sum()
    summary = {
        "scenario": scenario,
        "seed": game.scenario.seed,
        "pursuers": game.scenario.pursuers.size,
        "evaders": game.scenario.evaders.size,
        "seconds": game.scenario.seconds,
        "period": game.scenario.period,
        "tracking_time": run.tracking_time,
        "censored": run.lost_evader is None,
        "lost_evader": run.lost_evader,
        "assignment_changes": int((np.diff(log["assignment"], axis=0) != 0).sum()),
        "commands_reversed": int(reversals),
        "min_clearance": float(gaps.min()),
        "min_body_gap": float(bodies.min()) if bodies.size else None,
        "contacts": count_contacts(bodies),
        "bodies": game.scenario.has_bodies,
        "robot_radius": game.scenario.pursuers.radius,
        "evader_radius": game.scenario.evaders.radius,
        "wall_time": run.wall_time,
        "realtime_factor": float(run.times[-1]) / run.wall_time,
    }
    return summary | _certificate_of(run)


def _certificate_of(run: TrackingRun) -> dict[str, object]:
    """What the log says of the certificate; nothing where there is none."""
    if "certificate" not in run.log:
        return {}
    first = float(run.log["certificate"][0, 0])
    promises = audit_promises(run) if "withdrawn" in run.log else None
    return {
        "certificate": first if np.isfinite(first) else None,
        "certified": promises is not None,
        "certificate_withdrawn": None if promises is None else promises.withdrawn,
        "broken_promise": None if promises is None else promises.breach,
    }


def units_of(run: TrackingRun) -> dict[str, str]:
    """Units of the arrays in a run's log: UNITS, and of CERTIFICATE_UNITS what was logged."""
    return UNITS | {name: unit for name, unit in CERTIFICATE_UNITS.items() if name in run.log}


def log_arrays(run: TrackingRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in `units_of`, time first along every array's first axis."""
    centres = np.concatenate([run.log["pursuer_position"], run.log["evader_position"]], axis=1)
    gaps = pair_gaps(centres, run.game.radii).min(axis=1, initial=np.inf)
    return {"time": run.times, **run.log, "body_gap": gaps}
