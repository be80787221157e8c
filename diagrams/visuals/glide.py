"""Which of many samples a player that interpolates between keys needs."""

from math import inf

Values = tuple[float, ...]
Sample = tuple[int, Values]


class Glide:
    """Picks keys from samples so that straight lines between keys pass all others closely.

    A key is found out when the next sample no longer lies in line: then it was the one before.
    From the last key, every sample since leaves a cone of slopes that pass it within its
    tolerance; a sample in the cone of all before it needs no key yet.

    Source: the swinging door of Bristol, "Swinging door trending" (1990), with keys on samples.
    """

    __slots__ = ("_high", "_key", "_low", "_previous", "_tolerance", "frame", "values")

    def __init__(self, frame: int, values: Values, tolerance: Values) -> None:
        """Start with a sample.

        Args:
            frame: Its number.
            values: Its components, any unit.
            tolerance: How far each may be missed.
        """
        self.frame = frame
        self.values = values
        self._tolerance = tolerance
        # The last key, and the last sample but one; none before a second frame begins.
        self._key: Sample | None = None
        self._previous: Sample = (frame, values)

    def add(self, frame: int, values: Values, tolerance: Values) -> Sample | None:
        """Add a sample, after the last one or in its place.

        Returns:
            The frame and values of a key that is now known to be needed.
        """
        needed = self._settle() if frame > self.frame else None
        self.frame, self.values, self._tolerance = frame, values, tolerance
        return needed

    def finish(self) -> list[Sample]:
        """The keys that are still missing, that of the last sample among them."""
        needed = self._settle()
        last = (self.frame, self.values)
        return [last] if needed is None else [needed, last]

    def _settle(self) -> Sample | None:
        """Take the last sample for good."""
        last = (self.frame, self.values)
        if self._key is None:
            self._start_from(last)
            return last
        needed = None
        if not self._in_line(self._key):
            needed = self._previous
            self._start_from(needed)
        start_frame, start = needed or self._key
        steps = self.frame - start_frame
        if steps > 0:
            for k, value in enumerate(self.values):
                slope, slack = (value - start[k]) / steps, self._tolerance[k] / steps
                self._low[k] = max(self._low[k], slope - slack)
                self._high[k] = min(self._high[k], slope + slack)
        self._previous = last
        return needed

    def _in_line(self, key: Sample) -> bool:
        """Whether the last sample is in the cone of those between it and the key."""
        steps = self.frame - key[0]
        if self._previous[0] == key[0] or steps == 0:
            return True
        slopes = [(value - start) / steps for value, start in zip(self.values, key[1], strict=True)]
        return all(map(_between, self._low, slopes, self._high))

    def _start_from(self, key: Sample) -> None:
        self._key = self._previous = key
        self._low = [-inf] * len(key[1])
        self._high = [inf] * len(key[1])


def _between(low: float, value: float, high: float) -> bool:
    return low <= value <= high
