"""What an exhibit is, and what making it brings to light."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ...systems.numerics.errors import require_one_of
from ..studies.opponents import FEWER

AGREES, DIFFERS, UNDECIDED, SHOWN = "agrees", "differs", "cannot tell", "shown"

# What a verdict means; the weightiest first. An exhibit's own is the weightiest of its findings.
VERDICTS = {
    DIFFERS: "not what the thesis states",
    UNDECIDED: "the runs are too few to decide it",
    AGREES: "what the thesis states",
    SHOWN: "the thesis states nothing to compare with",
}


@dataclass(frozen=True)
class Finding:
    """One statement, and what came of it.

    Attributes:
        subject: What it is about.
        thesis: What the thesis states, in our words; empty: nothing.
        ours: What came out here.
        verdict: One of VERDICTS.

    Raises:
        InvalidInput: The verdict is none.
    """

    subject: str
    thesis: str
    ours: str
    verdict: str

    def __post_init__(self) -> None:
        require_one_of("verdict", self.verdict, VERDICTS)


@dataclass(frozen=True)
class Picture:
    """A PNG file, and a caption that says what it shows.

    Attributes:
        file: The PNG.
        caption: What it shows.
    """

    file: Path
    caption: str


@dataclass(frozen=True)
class Table:
    """Numbers side by side.

    Attributes:
        caption: What they are.
        head: Of the columns.
        rows: As many entries each.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Evidence:
    """What came of an exhibit."""

    pictures: tuple[Picture, ...]
    findings: tuple[Finding, ...]
    tables: tuple[Table, ...] = ()

    @property
    def verdict(self) -> str:
        """The weightiest verdict of its findings."""
        found = {finding.verdict for finding in self.findings}
        return next((verdict for verdict in VERDICTS if verdict in found), SHOWN)


@dataclass(frozen=True)
class Workshop:
    """How exhibits are to be made, and where.

    Attributes:
        quick: Coarser and with fewer runs, in minutes.
        pictures: Folder for PNG files; exists.
        studies: Folder for the runs of Monte Carlo studies, which continue what they find there.
        workers: Processes for studies, 0: this one.
        world: A map on which claims are judged as well; None: no other.
        runs: Of each cell of every study; None: as many as the exhibit takes. Against opponents
            that are slow to play (FEWER) never more than the exhibit takes.
        opponent_runs: Of each cell against some opponents, whatever the others say.
        progress: Told how many games of a study are played, and of how many.
    """

    quick: bool
    pictures: Path
    studies: Path
    workers: int = 0
    world: Path | None = None
    runs: int | None = None
    opponent_runs: Mapping[str, int] = field(default_factory=dict)
    progress: Callable[[int, int], None] = lambda done, total: None

    def runs_against(self, full: Mapping[str, int], quick: Mapping[str, int]) -> dict[str, int]:
        """How many runs of each cell against each opponent, in full or quickly, or as asked for.

        Args:
            full, quick: By opponent.
        """
        found = {}
        for opponent, usual in (quick if self.quick else full).items():
            runs = self.runs or usual
            fewer = min(runs, usual) if opponent in FEWER else runs
            found[opponent] = self.opponent_runs.get(opponent, fewer)
        return found


@dataclass(frozen=True)
class Exhibit:
    """Some figures or tables of the thesis that are made together.

    Attributes:
        id: To ask for it by.
        covers: The figures and tables, as "Figure 2.16"; empty: beyond the thesis.
        title: What it shows.
        states: What the thesis shows and says of it, in our words.
        command: What makes it alone, in more detail.
        make: Makes it.
    """

    id: str
    covers: tuple[str, ...]
    title: str
    states: str
    command: str
    make: Callable[[Workshop], Evidence]


def judged(holds: bool) -> str:
    """The verdict on a statement that was found to hold, or not."""
    return AGREES if holds else DIFFERS
