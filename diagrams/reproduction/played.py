"""Monte Carlo studies of exhibits, kept so that a report made again continues them."""

import hashlib
import json
from collections.abc import Sequence

from ..studies.claims.claim import FAILS, HOLDS, OPEN, Verdict
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


def findings_of(verdicts: Sequence[Verdict]) -> tuple[Finding, ...]:
    """Judged claims as findings."""
    return tuple(
        Finding(each.claim, each.says, each.evidence, _VERDICTS[each.verdict]) for each in verdicts
    )


def verdicts_by_assumption(everywhere: dict[str, tuple[Verdict, ...]]) -> Table:
    """How the verdicts vary with what the thesis does not state: a row for each claim."""
    columns = list(everywhere.values())
    return Table(
        "The same claims with other maps, evaders, robots and horizons, which the thesis does not "
        "state",
        ("claim", *everywhere),
        tuple(
            (first.claim, *(column[k].verdict for column in columns))
            for k, first in enumerate(columns[0])
        ),
    )
