"""`sightfield station check`: what is connected and what is missing."""

import json

from rich.console import Console

from ...station.check import Finding, all_found, check_laboratory
from .options import (
    DEFAULT_PORT,
    DEFAULT_SCENARIO,
    JsonOption,
    PortOption,
    ScenarioArgument,
    SettingOption,
    load,
)


def check(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    setting: SettingOption = None,
    as_json: JsonOption = False,
    port: PortOption = DEFAULT_PORT,
) -> None:
    """Say in plain words what of the laboratory is connected and what is missing; move nothing."""
    laboratory = load(scenario, setting)
    console = Console(highlight=False)
    findings: list[Finding] = []
    for finding in check_laboratory(laboratory, port):
        findings.append(finding)
        if not as_json:
            mark = "[green]yes[/]" if finding.found else "[red]no [/]"
            console.print(f"{mark}  [bold]{finding.thing}[/]: ", end="")
            # Names in brackets are no markup.
            console.print(finding.words, markup=False, soft_wrap=True)
    ready = all_found(findings)
    if as_json:
        print(json.dumps({"ready": ready, "findings": [vars(each) for each in findings]}, indent=2))
    elif ready:
        console.print("Everything is there: sightfield station --hardware")
    else:
        console.print("Not all is there for --hardware; --simulate needs none of it.")
