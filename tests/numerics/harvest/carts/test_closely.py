"""Parts of plans of carts by themselves: against slow references, and as they were recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.carts.cart_motion import CartMotion, free_intervals
from sightfield.systems.numerics.harvest.carts.cart_plan import Failure, Supply, ended
from sightfield.systems.numerics.harvest.carts.cut_times import (
    CELL,
    LOOKS,
    REACH,
    OpenGround,
    opens_along,
)
from sightfield.systems.numerics.harvest.carts.roadmap import Edges
from sightfield.systems.numerics.harvest.carts.search import Intervals, Task, search
from sightfield.systems.numerics.harvest.carts.tanks import Tank
from sightfield.systems.numerics.harvest.carts.traffic import (
    SAMPLE,
    box_of,
    cart_boxes,
    cart_traffic,
    combine_traffic,
    during,
    joined,
    least_gaps,
)
from sightfield.systems.numerics.harvest.carts.visit_choice import (
    Beginnings,
    FreeCart,
    Outlook,
    choose_visits,
)
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.carts.windows import (
    beside,
    drive_beside,
    gentle_runs,
    lane_beside,
)
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath


def test_free_intervals_are_the_runs_of_free_moments_after_the_ground_has_opened():
    rng = np.random.default_rng(31)
    blocked = rng.random((60, 24)) < np.linspace(0.0, 1.0, 60)[:, None]
    opens = np.where(rng.random(60) < 0.4, -np.inf, 3.0 + 0.5 * rng.integers(-2, 30, 60))
    first, begins, ends = free_intervals(blocked, opens, 3.0, 0.5)
    moments = 3.0 + 0.5 * np.arange(24)
    wanted = []
    for n in range(60):
        free = ~blocked[n] & (moments >= opens[n])
        runs = np.flatnonzero(np.diff(np.concatenate([[0], free, [0]])))
        own = [(moments[a], np.inf if b == 24 else moments[b - 1]) for a, b in runs.reshape(-1, 2)]
        assert (
            list(zip(begins[first[n] : first[n + 1]], ends[first[n] : first[n + 1]], strict=True))
            == own
        )
        wanted += own
    assert len(begins) == len(wanted) > 100


def opens_slowly(ground, box, pose):
    """The latest time of all cells under a lattice on a box that is grown by half a diagonal."""
    rear, front, half = box[0] - REACH, box[1] + REACH, box[2] + REACH
    ahead = np.linspace(rear, front, math.ceil((front - rear) / LOOKS) + 1)
    aside = np.linspace(-half, half, math.ceil(2 * half / LOOKS) + 1)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    latest = -math.inf
    for a in ahead:
        for b in aside:
            column = (pose[0] + c * a - s * b - ground.corner[0]) / CELL
            row = (pose[1] + s * a + c * b - ground.corner[1]) / CELL
            rows, columns = ground.times.shape
            if not (0 <= row < rows and 0 <= column < columns):
                return math.inf
            latest = max(latest, ground.times[int(row), int(column)])
    return latest


def test_ground_under_a_box_opens_with_the_last_of_its_cells():
    rng = np.random.default_rng(32)
    times = rng.uniform(0.0, 900.0, (70, 60))
    times[rng.random(times.shape) < 0.3] = -np.inf
    times[50:, 20:33] = np.inf
    ground = OpenGround(times, np.array([-4.3, 2.9]))
    poses = rng.uniform([-6, 0, -3], [28, 40, 3], (500, 3))
    inside = 0
    for box in (np.array([-0.7, 2.6, 1.3]), np.array([-1.4, 2.9, 0.2])):
        found = opens_along(ground, box, poses)
        wanted = [opens_slowly(ground, box, pose) for pose in poses]
        assert found.tolist() == wanted
        inside += np.isfinite(found).sum()
    assert inside > 300


def random_task(rng, nodes=14, edges=60):
    """Nodes that are free at times, and edges without places between them."""
    begins, ends, first = [], [], [0]
    for _ in range(nodes):
        marks = np.sort(rng.uniform(0.0, 200.0, 2 * rng.integers(1, 4)))
        begins += marks[::2].tolist()
        ends += [*marks[1:-1:2].tolist(), np.inf if rng.random() < 0.5 else marks[-1]]
        first.append(len(begins))
    none3, none = np.zeros((0, 3)), np.zeros(0)
    table = Edges(
        source=rng.integers(0, nodes, edges),
        target=rng.integers(0, nodes, edges),
        poses=np.zeros((edges, 5, 3)),
        lengths=np.zeros((edges, 4)),
        duration=rng.uniform(3.0, 30.0, edges),
        opens=np.where(rng.random(edges) < 0.5, -np.inf, rng.uniform(0.0, 120.0, edges)),
        circle=np.zeros((edges, 3)),
        first=np.zeros(edges + 1, dtype=np.int64),
        tractor=none3,
        trailer=none3,
        since=none,
    )
    return Task(
        table,
        rng.random(edges) < 0.1,
        Intervals(np.array(first), np.array(begins), np.array(ends)),
        cart_traffic(Cart(), [], 0),
        cart_boxes(Cart()),
        1.0,
        np.zeros(len(begins), dtype=bool),
        np.zeros(nodes),
    )


def earliest(task, start, time, until):
    """The earliest time in each interval, by relaxing all edges again and again."""
    first, begins, ends = task.intervals
    owner = np.repeat(np.arange(len(first) - 1), np.diff(first))
    best = np.full(len(begins), np.inf)
    best[(owner == start) & (begins <= time) & (time <= ends)] = time
    for _ in range(len(begins)):
        for i in np.flatnonzero(best < np.inf):
            for e in np.flatnonzero((task.edges.source == owner[i]) & ~task.banned):
                lasts, opens = task.edges.duration[e], task.edges.opens[e]
                for j in np.flatnonzero(owner == task.edges.target[e]):
                    leave = max(best[i], opens, begins[j] - lasts)
                    if leave <= min(ends[i], ends[j] - lasts, until):
                        best[j] = min(best[j], leave + lasts)
    return best


@pytest.mark.parametrize("seed", range(12))
def test_a_search_finds_the_earliest_way(seed):
    rng = np.random.default_rng([33, seed])
    task = random_task(rng)
    first, begins, ends = task.intervals
    time = float(begins[0] + 0.4 * (min(ends[0], 200.0) - begins[0]))
    until = 1e9 if seed % 2 else 90.0
    best = earliest(task, 0, time, until)
    edges, found_some = task.edges, 0
    for goal in range(first[1], len(begins)):
        goals = np.arange(len(begins)) == goal
        found = search(task._replace(goals=goals), 0, time, back=False, until=until)
        assert (len(found) > 0) == (best[goal] < np.inf)
        found_some += len(found) > 0
        if len(found) == 0:
            continue
        # The edges lead from the start to the goal, and none is banned.
        assert edges.source[found[0]] == 0
        assert (edges.target[found[:-1]] == edges.source[found[1:]]).all()
        assert edges.target[found[-1]] == np.searchsorted(first, goal, side="right") - 1
        assert not task.banned[found].any()
        # Only by these edges nobody is earlier, and with all of them nobody either.
        only = np.ones(len(edges.source), dtype=bool)
        only[found] = False
        assert earliest(task._replace(banned=only), 0, time, until)[goal] == pytest.approx(
            best[goal]
        )
    assert found_some > 0 or not np.isfinite(best[first[1] :]).any()


def latest(task, goal, time, until):
    """The latest time in each interval from which the goal is reached in time."""
    first, begins, ends = task.intervals
    owner = np.repeat(np.arange(len(first) - 1), np.diff(first))
    best = np.full(len(begins), -np.inf)
    best[(owner == goal) & (begins <= time) & (time <= ends)] = time
    for _ in range(len(begins)):
        for j in np.flatnonzero(best > -np.inf):
            for e in np.flatnonzero((task.edges.target == owner[j]) & ~task.banned):
                lasts, opens = task.edges.duration[e], task.edges.opens[e]
                for i in np.flatnonzero(owner == task.edges.source[e]):
                    arrive = min(best[j], ends[i] + lasts)
                    if arrive >= max(begins[j], begins[i] + lasts, opens + lasts, until):
                        best[i] = max(best[i], arrive - lasts)
    return best


@pytest.mark.parametrize("seed", range(12))
def test_a_search_backwards_finds_the_latest_way(seed):
    rng = np.random.default_rng([34, seed])
    task = random_task(rng)
    first, begins, ends = task.intervals
    time = float(
        begins[first[1] - 1] + 0.6 * (min(ends[first[1] - 1], 230.0) - begins[first[1] - 1])
    )
    until = -1e9 if seed % 2 else 40.0
    best = latest(task, 0, time, until)
    edges = task.edges
    for start in range(first[1], len(begins)):
        goals = np.arange(len(begins)) == start
        found = search(task._replace(goals=goals), 0, time, back=True, until=until)
        assert (len(found) > 0) == (best[start] > -np.inf)
        if len(found) == 0:
            continue
        assert edges.target[found[-1]] == 0
        assert (edges.target[found[:-1]] == edges.source[found[1:]]).all()
        only = np.ones(len(edges.source), dtype=bool)
        only[found] = False
        assert latest(task._replace(banned=only), 0, time, until)[start] == pytest.approx(
            best[start]
        )


COMBINES = [
    Combine(capacity=8000.0, unload_rate=100.0, header_width=8.0),
    Combine(capacity=6500.0, unload_rate=85.0, header_width=8.0, speed=1.3),
    Combine(capacity=7000.0, unload_rate=16.0, header_width=8.0),
]


@pytest.mark.parametrize("strategy", ["sequential", "on-demand"])
@pytest.mark.parametrize("seed", range(8))
def test_choices_of_visits_are_as_recorded(as_recorded, seed, strategy):
    rng = np.random.default_rng([35, seed])
    team = COMBINES[: 1 + seed % 3]
    times = np.arange(0.0, 1500.0)
    tanks = []
    for n, combine in enumerate(team):
        cut = np.cumsum(rng.uniform(0.0, 13.0 + 4 * n, len(times)) * (times < 900.0 + 80 * n))
        tanks.append(Tank(combine, times, cut + rng.uniform(0.0, 0.9 * combine.capacity)))
        if rng.random() < 0.3:
            tanks[-1].take(tanks[-1].pour(40.0, 700.0, np.inf))
    spans = [
        (n, a, a + rng.uniform(30, 260)) for n in range(len(team)) for a in rng.uniform(0, 900, 4)
    ]
    at = [np.arange(a, b, 5.0) for _, a, b in spans]
    number = np.repeat(np.arange(len(spans)), [len(each) for each in at])
    whose = np.array([n for n, _, _ in spans])[number]
    every = np.concatenate(at)
    there = Beginnings(
        every, whose, number, np.array([b for _, _, b in spans])[number], 1 + number
    ).chosen(np.argsort(every, kind="stable"))
    ways = rng.uniform(20.0, 160.0, (40, 40))
    room = [np.inf, 3000.0, 9000.0]
    carts = [
        FreeCart(
            k, 20 + k, rng.uniform(0, 200), room[(k + seed) % 3], range(len(team)), seed % len(team)
        )
        for k in range(1 + seed % 2)
    ]
    outlook = Outlook(
        team, 0.7, tanks, there, carts, lambda node, time: time + ways[node], strategy,
        0.35 + 0.1 * (seed % 3),
    )  # fmt: skip
    as_recorded([list(choose_visits(outlook)), list(choose_visits(outlook._replace(hurries=True)))])


@pytest.mark.parametrize("seed", range(4))
def test_visits_to_a_tank_are_as_recorded(as_recorded, seed):
    rng = np.random.default_rng([36, seed])
    times = np.arange(0.0, 700.0)
    cut = np.cumsum(rng.uniform(0.0, 22.0, len(times)) * (times < 611.0))
    tank = Tank(Combine(capacity=5000.0, unload_rate=77.0), times, cut)
    found = []
    for begin in np.sort(rng.uniform(20.0, 660.0, 6)):
        for latest_, room in ((begin + 31.7, np.inf), (np.inf, 1803.3), (np.inf, np.inf)):
            found.append(tank.pour(begin, latest_, room))
        tank.take(found[-1 - seed % 3])
        found.append([tank.full_at(), tank.left, tank.load[::50]])
    as_recorded(found)


def test_a_tank_is_full_at_its_capacity():
    tank = Tank(Combine(capacity=50.0), np.arange(9.0), 10.0 * np.arange(9.0))
    assert tank.full_at() == 5.0
    assert Tank(Combine(capacity=80.1), tank.times, tank.cut).full_at() == np.inf


def winding():
    """A combine's path: straights, wide bends, a tight one, and a piece backwards."""
    bends = [0.0, 1 / 60, 1 / 45.5, -1 / 44.0, 0.0, -1 / 70, 0.0, 1 / 9, 0.0]
    ways = [40.0, 55.0, 31.0, 28.0, 12.0, 70.0, 14.0, 12.0, 33.0]
    gears = [1, 1, 1, 1, 1, 1, -1, 1, 1]
    poses = [(3.0, -7.0, 0.8)]
    for bend, way, gear in zip(bends, ways, gears, strict=True):
        x, y, theta = poses[-1]
        turn = gear * bend * way
        chord = gear * way * np.sinc(turn / 2 / math.pi)
        middle = theta + turn / 2
        poses.append((x + chord * math.cos(middle), y + chord * math.sin(middle), theta + turn))
    return MachinePath.of(poses, gears=gears, cutting=True)


def test_lanes_beside_a_winding_path_are_as_recorded(as_recorded):
    path = winding()
    times = np.linspace(0.0, path.length / 1.4, 30)
    plan = TimedPath(path, times, np.linspace(0.0, path.length, 30), np.full(30, 1.4))
    runs = gentle_runs(path)
    place = beside(Combine(header_width=7.0, cart_gap=1.1), Cart(length=4.7, hitch_offset=0.4))
    as_recorded([runs, place])
    assert len(runs) >= 2
    for number, (first, last) in enumerate(runs):
        lane = lane_beside(path, first, last, place)
        begin, end = (first + 2.0) / 1.4, (last - 1.0) / 1.4
        driven = drive_beside(plan, lane, begin, end)
        as_recorded([lane.path.poses, lane.of_combine, lane.of_tractor], f"lane {number}")
        as_recorded(
            [driven.path.poses, driven.times, driven.stations, driven.speeds], f"drive {number}"
        )


def test_traffic_is_joined_and_cut_to_spans_as_recorded(as_recorded, hand_made):
    made = hand_made(120.0, 90.0, 2)
    traffic = combine_traffic(made.combine, made.plans)
    path = MachinePath.of([(5.0, -9.0, 0.1), (30.0, 4.0, 0.9), (44.0, 30.0, 1.3)])
    at = np.array([0.0, path.length / 2, path.length])
    drives = TimedPath(path, np.array([40.0, 47.0, 59.0]), at, np.array([0.0, 5.0, 0.0]))
    stays = cart_traffic(Cart(), [[CartMotion(drives, Cart(), 0.2)]], 2, 45.0)
    as_recorded([stays._replace(poses=stays.poses[:, ::7], middles=stays.middles[:, ::7])], "cart")
    span = during(traffic, 45.0, 52.0)
    as_recorded(during(traffic, 880.0, 893.0), "after the end")
    both = joined(span, stays)
    assert both.poses.shape[1] == max(span.poses.shape[1], stays.poses.shape[1])
    as_recorded(both, "joined")
    poses = np.column_stack([np.linspace(-60, 130, 50), np.linspace(0, 80, 50), np.arange(50.0)])
    moments = np.linspace(30.0, 70.0, 50)
    as_recorded(least_gaps(both, cart_boxes(Cart()), poses, poses - 3.0, moments), "gaps")
    assert box_of(np.array([[-1.0, -2.0], [3.0, -2.0], [3.0, 2.0], [-1.0, 2.0]])).tolist() == [
        -1.0,
        3.0,
        2.0,
    ]
    assert SAMPLE == 0.25


def test_a_plan_is_cut_off_at_a_time_or_where_it_stands_for_ever():
    path = MachinePath.of([(0.0, 0.0, 0.0), (30.0, 0.0, 0.0)])
    plan = TimedPath(
        path, np.array([0.0, 10.0, 2e6]), np.array([0.0, 20.0, 30.0]), np.array([0.0, 4.0, 0.0])
    )
    assert ended(plan).times.tolist() == [0.0, 10.0]
    cut = ended(plan, 5.0)
    assert cut.times.tolist() == [0.0, 5.0]
    assert cut.stations.tolist() == [0.0, 5.0]
    assert cut.speeds.tolist() == [0.0, 2.0]
    assert ended(plan, 10.0).times.tolist() == [0.0, 10.0]
    assert ended(plan, 10.0).speeds.tolist() == [0.0, 4.0]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"strategy": "best"}, "`strategy`"),
        ({"visits": "all"}, "`visits`"),
        ({"threshold": 0.0}, "`threshold`"),
        ({"threshold": 1.01}, "`threshold`"),
        ({"failure": Failure(-1, 9.0)}, "`failing_cart`"),
    ],
)
def test_what_no_service_is_is_refused(hand_made, more, said):
    made = hand_made(126.0, 100.0, 1)
    supply = Supply(density=1.0, trucks=np.array([[60.0, -13.0, 0.1], [100.0, -14.0, 0.0]]))
    planned = made.field, [made.combine], Cart(), made.plans, made.swaths, supply, made.retime
    with pytest.raises(InvalidInput, match=said):
        serve_combines(*planned, **more)
