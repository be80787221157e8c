"""Monte Carlo studies of exhibits, kept so that a report made again continues them."""

import hashlib
import json
from collections.abc import Mapping, Sequence

from ..studies.claims import FAILS, HOLDS, OPEN, Judgement
from ..studies.engine import run_study
from ..studies.records import StudyResult
from ..studies.study import Study, study_to_json
from .evidence import AGREES, DIFFERS, UNDECIDED, Finding, Table, Workshop

_VERDICTS = {HOLDS: AGREES, FAILS: DIFFERS, OPEN: UNDECIDED}


def played(workshop: Workshop, study: Study) -> StudyResult:
    """Play a study, or what is left of it, in a folder named for all that it is made of."""
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
