"""What is simulated: a pursuer that keeps its distance to an evader on a line."""

from dataclasses import dataclass, field

from ...systems.numerics.errors import require, require_finite, require_non_negative
from ...systems.numerics.standoff.loop import StandoffLoop
from ...systems.numerics.standoff.sampled_pid import SampledPid


@dataclass(frozen=True, kw_only=True)
class StandoffScenario:
    """A run of the block diagram. The pursuer starts at zero.

    Raises:
        InvalidInput: A number is out of its range.
    """

    loop: StandoffLoop = field(default_factory=StandoffLoop)
    sampled: SampledPid = field(default_factory=SampledPid)
    # Distance at the start [m].
    start: float = 0.1
    # Mean speed of the evader, and how much and how fast it sways about that [m/s], [rad/s].
    evader_speed: float = 0.0
    evader_sway: float = 0.0
    sway_frequency: float = 1.0
    # Whether the pursuer knows the evader's velocity.
    feed_forward: bool = True
    # Standard deviation of the estimate's noise, drawn anew at every sample [m], and its seed.
    noise: float = 0.0
    seed: int = 0
    # How many samples late the estimate comes.
    delay_samples: int = 0

    def __post_init__(self) -> None:
        for name in ("start", "evader_speed", "evader_sway"):
            require_finite(name, getattr(self, name))
        for name in ("sway_frequency", "noise", "seed", "delay_samples"):
            require_non_negative(name, getattr(self, name))
        whole = isinstance(self.delay_samples, int) and isinstance(self.seed, int)
        require(whole, "seed, delay_samples", "be integers", (self.seed, self.delay_samples))
