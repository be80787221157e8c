"""How a run keeps its pace, ends, bridges gaps in a log, and what is told of faults in it."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.diagrams.station import fault_campaign
from sightfield.diagrams.station import run as run_module
from sightfield.diagrams.station.fault_campaign import Moment, _Campaign, _told, _wait
from sightfield.diagrams.station.hardware import Operator
from sightfield.diagrams.station.laboratories import Gaps
from sightfield.diagrams.station.ports import REASON
from sightfield.diagrams.station.run import FAILURE, HORIZON, LOSS, STOP, _paced, _play
from sightfield.systems.numerics.errors import InvalidInput, SightfieldError
from sightfield.systems.numerics.station.supervision import Reason


def test_memory_is_given_back_after_a_gap_and_once():
    times = np.array([0.0, 0.05, 0.1, 0.25, 0.3, 0.45, 0.5])
    memory = [(0.05, "a"), (0.25, "b"), (0.3, "c"), (0.5, "d")]
    gaps = Gaps(SimpleNamespace(times=times, memory=memory), 0.05)
    given = [gaps.memory_after(tick) for tick in range(11)]
    assert given == [None] * 5 + ["b"] + [None] * 4 + ["d"]


@pytest.fixture
def clock(monkeypatch):
    made = SimpleNamespace(now=5.0)
    monkeypatch.setattr(run_module, "time", SimpleNamespace(perf_counter=lambda: made.now))
    return made


def test_who_falls_behind_by_half_a_period_begins_to_count_anew(clock):
    reset = []
    simulator = SimpleNamespace(
        get_target_realtime_rate=lambda: 2.0, ResetStatistics=lambda: reset.append(clock.now)
    )
    took = iter([0.05, 0.07, 0.056, 0.049, 0.0745, 0.02, 0.09])

    def advance(tick):
        clock.now += next(took)

    paced = _paced(advance, simulator, 0.1)
    for tick in range(7):
        paced(tick)
    # A tick of 0.1 s takes 0.05 s here, and 0.025 s more are allowed.
    assert reset == pytest.approx([5.176, 5.4095])
    simulator.get_target_realtime_rate = lambda: 0.0
    assert _paced(advance, simulator, 0.1) is advance


class Port:
    """Of a system that has a value for each tick."""

    def __init__(self, values):
        self.values, self.tick = values, 0

    def get_system(self):
        return SimpleNamespace(GetMyContextFromRoot=lambda context: context)

    def Eval(self, context):
        return self.values[min(context.tick, len(self.values) - 1)]


def play(clock, ticks=None, losses=((math.inf, -1),), clocks=(), operator=None, fail=None):
    context = SimpleNamespace(tick=0, get_time=lambda: 0.1 * context.tick + 0.05)

    def advance(tick):
        if fail is not None and tick == fail[0]:
            raise fail[1]
        context.tick = tick
        clock.now += 0.02

    told = [(each,) for each in clocks] or [(0.1 * k,) for k in range(99)]
    scenario = SimpleNamespace(period=0.1, seconds=0.7)
    return _play(advance, context, Port(losses), Port(told), scenario, operator, ticks)


def test_a_run_goes_to_its_horizon(clock):
    done = play(clock)
    assert (done.how, done.lost_evader, done.failure) == (HORIZON, None, "")
    assert done.tracking_time == pytest.approx(0.7)
    assert done.wall_time == pytest.approx(8 * 0.02)
    assert done.realtime_factor == pytest.approx(0.7 / 0.16)
    assert play(clock, ticks=4).tracking_time == pytest.approx(0.3)


def test_a_run_ends_with_a_loss_since_which_no_time_counts(clock):
    never = (math.inf, -1.0)
    done = play(clock, losses=[never, never, never, (0.22, 2.0)])
    assert (done.how, done.lost_evader) == (LOSS, 2)
    assert done.tracking_time == pytest.approx(0.22)
    # While robots stand the clock does, too.
    still = play(clock, losses=[never, never, (0.12, 0.0)], clocks=[0.0, 0.1, 0.1])
    assert (still.tracking_time, still.lost_evader) == (0.1, 0)
    # One that is played again goes on.
    again = play(clock, ticks=6, losses=[never, (0.02, 1.0)])
    assert (again.how, again.lost_evader) == (HORIZON, 1)
    assert again.tracking_time == pytest.approx(0.5 - (0.5 - 0.02))


def test_a_run_ends_when_the_operator_stops_it_or_a_device_fails(clock):
    operator = Operator()
    assert play(clock, operator=operator).how == HORIZON
    operator.say("stop")
    assert play(clock, operator=operator).how == STOP
    assert play(clock, operator=operator, ticks=3).how == HORIZON
    failed = play(clock, fail=(3, SightfieldError("unplugged")))
    assert (failed.how, failed.failure) == (FAILURE, "unplugged")
    assert failed.tracking_time == pytest.approx(0.2)
    for tick, error in ((0, SightfieldError("at once")), (2, InvalidInput("wrong"))):
        with pytest.raises(type(error)):
            play(clock, fail=(tick, error))


def test_reasons_are_those_that_were_told_while_a_fault_lasted(monkeypatch):
    times = 0.05 * np.arange(20)
    reasons = np.zeros((20, 4))
    reasons[3, 1], reasons[4, 1], reasons[8, 1] = 8, 9, 12
    reasons[9, 1], reasons[2, 1], reasons[5, 0], reasons[6, 3] = 13, 7, 13, 6
    log = SimpleNamespace(times=times, samples={REASON: reasons})
    monkeypatch.setattr(fault_campaign, "read_run_log", lambda path: log)
    moment = Moment("x", (1, 2), 0.1, 0.4, 0.3, visible=0.1)
    (found,) = _told([moment], None, SimpleNamespace(period=0.05, size=4))
    assert found.reasons == ((Reason.JUMP, Reason.FLIP, Reason.NOT_FOLLOWING), ())
    assert found.others == (Reason.NOT_SEEN, Reason.FENCE)
    assert found.noticed == pytest.approx(0.2)
    assert Moment("x", (1,), 0.1, 0.4, 0.3, visible=0.5).noticed == 0.0


def test_a_campaign_begins_with_the_first_tick_and_ends_the_run():
    began = []
    campaign = _Campaign.__new__(_Campaign)
    campaign._thread = SimpleNamespace(
        ident=None, start=lambda: began.append(True), is_alive=lambda: True
    )
    campaign._failure = None
    campaign.at_tick(0.5)
    assert (began, campaign._now) == ([True], 0.5)
    campaign._thread.ident = 7
    campaign.at_tick(0.6)
    campaign._thread.is_alive = lambda: False
    with pytest.raises(fault_campaign._Over):
        campaign.at_tick(0.7)
    campaign._failure = RuntimeError("why")
    with pytest.raises(RuntimeError, match="why"):
        campaign.at_tick(0.8)
    assert len(began) == 1


def test_waiting_ends_when_it_is_over(monkeypatch):
    clock = SimpleNamespace(now=1.0, looks=0)

    def sleep(duration):
        assert duration == 0.002
        clock.now += duration

    monkeypatch.setattr(
        fault_campaign, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep)
    )
    assert _wait(lambda: clock.now > 1.05, 0.1)
    assert clock.now == pytest.approx(1.052)
    assert not _wait(lambda: False, 0.1)
    assert clock.now == pytest.approx(1.154, abs=0.0021)
