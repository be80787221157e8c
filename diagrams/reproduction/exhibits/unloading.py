"""Figures 3.4 to 3.6: how one cart serves two, three and more combines."""

from dataclasses import replace

from ....systems.numerics.harvest.schedule.answer import answer_schedule, answer_timetable
from ....systems.numerics.harvest.schedule.closed_forms import (
    EqualCombines,
    loads_at_start,
    travel_time_max,
    waiting_sum,
)
from ....systems.numerics.harvest.schedule.first_round import drawn_timetable, first_loads
from ...schedule.load_diagram import save_load_diagram
from ..evidence import Evidence, Exhibit, Finding, Picture, Workshop, judged

# Of our choice, the figures having no numbers: kg, kg/s.
CAPACITY, FILL, UNLOAD = 9000.0, 20.0, 150.0
# As parts: from the longest way to one that is surely shorter or longer, and what rounding costs.
SIDE, ROUNDING = 1e-6, 1e-9
# Rounds that are simulated.
ROUNDS = 40


def _limit_as_printed(combines: int) -> float:
    """(3.1), (3.7) and (3.10): the longest way between neighbours [s]."""
    c, f, u = CAPACITY, FILL, UNLOAD
    if combines == 2:
        return (u * c - 2 * f * c) / (2 * f * (u - f))
    if combines == 3:
        return (u - 3 * f) * c / (4 * f * (u - f))
    return (u - combines * f) * c / ((2 * combines - 2) * f * (u - f))


def _make(workshop: Workshop, combines: int, number: str) -> Evidence:
    limit = _limit_as_printed(combines)
    equal = EqualCombines(combines, CAPACITY, FILL, UNLOAD, 0.8 * limit)
    answer = answer_schedule(equal.fleet())
    drawn = drawn_timetable(answer, 2)
    file = workshop.pictures / f"figure_{number.replace('.', '_')}.png"
    save_load_diagram(file, answer, drawn)
    within, beyond = (
        replace(equal, travel_time=limit * (1 + side)).fleet() for side in (-SIDE, SIDE)
    )
    overflows = answer_timetable(answer_schedule(within), ROUNDS).overflows
    refused = not answer_schedule(beyond).feasible
    loads, expected = first_loads(equal.fleet(), drawn), loads_at_start(equal)
    apart = max(abs(a - b) for a, b in zip(loads, expected, strict=True))
    return Evidence(
        (Picture(file, f"Loads of {combines} tanks, and below them what the cart does."),),
        (
            Finding(
                "The longest way between neighbours",
                f"Printed bound on dT, here {limit:.4f} s.",
                f"Our closed form {travel_time_max(equal):.4f} s. By linear programming a "
                f"schedule exists a millionth below it and {'none' if refused else 'one too'} "
                f"above; simulated for {ROUNDS} rounds, "
                f"{'no tank runs' if not overflows else 'a tank runs'} over.",
                judged(
                    abs(travel_time_max(equal) / limit - 1) < ROUNDING and refused and not overflows
                ),
            ),
            Finding(
                "The first round",
                "The first and the last combine are full when the cart comes; those between hold "
                "C' of their own.",
                f"Loads found: {', '.join(f'{load:.0f}' for load in loads)} kg, by the closed "
                f"form to {apart:.1g} kg; waiting times sum to {waiting_sum(equal):.1f} s.",
                judged(apart < CAPACITY * ROUNDING),
            ),
        ),
    )


def _exhibit(number: str, combines: int, equations: str) -> Exhibit:
    command = (
        f"sightfield schedule --combines {combines} --capacity {CAPACITY:g} --fill-rate {FILL:g} "
        f"--unload-rate {UNLOAD:g} --travel-time {0.8 * _limit_as_printed(combines):.2f} "
        "--out out/schedule"
    )
    return Exhibit(
        id=f"figure-{number}",
        covers=(f"Figure {number}",),
        title=f"Scheduling for {'N' if number == '3.6' else combines} combines",
        states="The load of each tank over time, and the cart's waiting times; from it the "
        f"conditions {equations}. The figure has no numbers: ours are C = {CAPACITY:g} kg, "
        f"r_f = {FILL:g} and r_u = {UNLOAD:g} kg/s"
        + (f", N = {combines}." if number == "3.6" else "."),
        command=command,
        make=lambda workshop: _make(workshop, combines, number),
    )


UNLOADING = (
    _exhibit("3.4", 2, "(3.1)"),
    _exhibit("3.5", 3, "(3.2) to (3.7)"),
    _exhibit("3.6", 5, "(3.8) to (3.10)"),
)
