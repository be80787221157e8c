"""A report in words and numbers for programs."""

from collections.abc import Sequence
from dataclasses import asdict

from .make_exhibits import Made


def summarise(made: Sequence[Made], *, quick: bool) -> dict[str, object]:
    """The report, ready for JSON.

    Returns:
        quick, seconds (all in all) [s], and exhibits: id, covers, title, command, verdict, seconds,
        error (None if there was none), findings (subject, thesis, ours, verdict each).
    """
    return {
        "quick": quick,
        "seconds": sum(each.seconds for each in made),
        "exhibits": [
            {
                "id": each.exhibit.id,
                "covers": list(each.exhibit.covers),
                "title": each.exhibit.title,
                "command": each.exhibit.command,
                "verdict": each.verdict,
                "seconds": each.seconds,
                "error": each.error.strip().splitlines()[-1] if each.error else None,
                "findings": [asdict(finding) for finding in each.evidence.findings]
                if each.evidence
                else [],
            }
            for each in made
        ],
    }
