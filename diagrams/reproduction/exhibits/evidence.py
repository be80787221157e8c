"""What an exhibit is, and what making it brings to light."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

from ....systems.numerics.checked import Checked, one_of
from ...studies.claims import FAILS, HOLDS, OPEN, Judgement
from ...studies.engine import run_study
from ...studies.opponents import FEWER
from ...studies.records import StudyResult
from ...studies.study import Study, study_to_json

AGREES, DIFFERS, UNDECIDED, SHOWN = "agrees", "differs", "cannot tell", "shown"

# What a verdict means; the weightiest first. An exhibit's own is the weightiest of its findings.
VERDICTS = {
    DIFFERS: "not what the thesis states",
    UNDECIDED: "the runs are too few to decide it",
    AGREES: "what the thesis states",
    SHOWN: "the thesis states nothing to compare with",
}


@dataclass(frozen=True)
class Finding(Checked):
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
    verdict: Annotated[str, one_of(VERDICTS)]


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
        seconds: Longest game of a study [s]; None: as long as the exhibit takes.
        progress: Told how many games of a study are played, and of how many.
    """

    quick: bool
    pictures: Path
    studies: Path
    workers: int = 0
    world: Path | None = None
    runs: int | None = None
    opponent_runs: Mapping[str, int] = field(default_factory=dict)
    seconds: float | None = None
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


_VERDICTS = {HOLDS: AGREES, FAILS: DIFFERS, OPEN: UNDECIDED}


def played(workshop: Workshop, study: Study) -> StudyResult:
    """Play a study, or what is left of it, in a folder named for all that it is made of."""
    if workshop.seconds is not None:
        seconds = min(workshop.seconds, study.base.seconds)
        study = replace(study, base=replace(study.base, seconds=seconds))
    settings = json.dumps(study_to_json(study), sort_keys=True)
    digest = hashlib.sha256(settings.encode()).hexdigest()[:10]
    folder = workshop.studies / f"{study.name}-{digest}"
    return run_study(study, folder, workers=workshop.workers, progress=workshop.progress)


def fewest(runs: Mapping[str, int], most: Mapping[str, int]) -> dict[str, int]:
    """Runs of a variant by opponent: no more than `most`, nor than the study itself has.

    Args:
        runs: Of each cell of the study, by opponent.
        most: Of each cell of the variant, by opponent; one that the study has not may have as
            many as the study has at most.
    """
    asked = max(runs.values())
    return {opponent: min(number, runs.get(opponent, asked)) for opponent, number in most.items()}


def findings_of(judgements: Sequence[Judgement]) -> tuple[Finding, ...]:
    """Judged claims as findings; each is what the strongest opponent leaves of it."""
    return tuple(
        Finding(each.claim, each.strongest.says, each.evidence, _VERDICTS[each.verdict])
        for each in judgements
    )


def verdicts_by_assumption(everywhere: dict[str, tuple[Judgement, ...]]) -> Table:
    """How the verdicts vary with what the thesis does not state: a row for each claim.

    A column for each opponent that a claim was judged against; a star is at the strongest's.
    """
    columns = [
        (f"{name}, {verdict.opponent}", k)
        for name, judgements in everywhere.items()
        for k, verdict in enumerate(judgements[0].against)
    ]
    judged = [judgements for judgements in everywhere.values() for _ in judgements[0].against]
    return Table(
        "The same claims against each opponent (* the strongest, where there are several), with "
        "other maps, robots and horizons, which the thesis does not state",
        ("claim", *(head for head, _ in columns)),
        tuple(
            (
                first.claim,
                *(
                    _entry(judgements[row], k)
                    for judgements, (_, k) in zip(judged, columns, strict=True)
                ),
            )
            for row, first in enumerate(judged[0])
        ),
    )


def _entry(judgement: Judgement, k: int) -> str:
    verdict = judgement.against[k]
    several = len(judgement.against) > 1
    return verdict.verdict + (" *" if several and verdict is judgement.strongest else "")
