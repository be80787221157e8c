"""A recorded run written down anew: an old log as MCAP, which other tools open, or back."""

from pathlib import Path

import numpy as np

from .record import open_run_writer
from .replay import Recording


def convert_recording(recording: Recording, path: Path) -> None:
    """Write a recorded run down anew, to the last bit: as MCAP if the name ends so, or as a log.

    What is lost of a damaged log stays lost, and one that was never closed is not closed.

    Args:
        recording: Of a station, as far as its log tells.
        path: Must not exist.

    Raises:
        InvalidInput: The file exists or cannot be written, or the extra is not installed.
    """
    log = recording.log
    kept = {name: len(values) for _, each in log.memory[:1] for name, values in each.items()}
    writer = open_run_writer(
        path,
        recording.scenario,
        recording.game,
        ports={name: samples.shape[1] for name, samples in log.samples.items()},
        pictures=tuple(log.pictures),
        memory=kept,
        about=log.about,
    )
    table = np.concatenate([*log.samples.values()], axis=1)
    # At one time a picture comes after the samples, and what is kept before the next ones.
    events = [(time, 0, row) for row, time in enumerate(log.times.tolist())]
    shown = [(time, name, png) for name, each in log.pictures.items() for time, png in each]
    events += [(time, 1, row) for row, (time, _, _) in enumerate(shown)]
    events += [(time, 2, row) for row, (time, _) in enumerate(log.memory)]
    # Not by `with`: leaving a log open is no failure here.
    try:
        for time, what, row in sorted(events):
            if what == 0:
                writer.samples(time, table[row])
            elif what == 1:
                writer.picture(*shown[row])
            else:
                writer.memory(time, np.concatenate([*log.memory[row][1].values()]))
    except BaseException:
        writer.leave()
        raise
    if log.complete:
        writer.close()
    else:
        writer.leave()
