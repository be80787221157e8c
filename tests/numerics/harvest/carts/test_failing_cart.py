"""A cart that fails for good: nothing differs before, the others fetch all that is left."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.carts.cart_plan import Failure, Supply
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.machines import Cart

TRUCKS = np.array([[60.0, -13.0, 0.1], [100.0, -14.0, 0.0]])
CART = Cart(capacity=20000.0, hitch_offset=0.3)


@pytest.mark.parametrize(("cart", "time"), [(0, 450.0), (1, 500.0)])
def test_what_a_failing_cart_leaves_is_fetched_by_the_others(hand_made, audit, cart, time):
    made = hand_made(126.0, 100.0, 1)
    supply = Supply(density=1.6, trucks=TRUCKS)
    team = [made.combine] * len(made.plans)
    planned = made.field, team, CART, made.plans, made.swaths, supply, made.retime
    before = serve_combines(*planned)
    after = serve_combines(*planned, failure=Failure(cart, time))
    early = np.arange(0.0, time, 0.5)
    pairs = [
        *zip(before.plans, after.plans, strict=True),
        *((b.timed, a.timed) for b, a in zip(before.motions, after.motions, strict=True)),
    ]
    for old, new in pairs:
        assert (old.station_at(early) == new.station_at(early)).all()
    # It ends what it was at, one visit at most, and comes to its truck.
    assert sum(visit.cart == cart and visit.begin > time for visit in after.visits) <= 1
    own = [trip for trip in after.trips if trip.cart == cart]
    assert sum(trip.begin > time for trip in own) <= 1
    assert after.motions[cart].timed.end <= own[-1].end
    assert after.left == pytest.approx(0.0, abs=2.0)
    taken, delivered = (
        sum(visit.taken for visit in after.visits),
        sum(trip.delivered for trip in after.trips),
    )
    assert taken == pytest.approx(sum(visit.taken for visit in before.visits), abs=2.0)
    assert delivered == pytest.approx(taken)
    found = audit(made.field, made.combine, CART, after.plans, after.motions)
    assert found.combine_gap >= 0.5
    assert found.cart_gap >= 0.5
    assert found.outside == 0.0


@pytest.mark.parametrize(
    ("trucks", "cart", "message"), [(1, 0, "`carts`"), (2, 2, "`failing_cart`")]
)
def test_a_cart_that_nobody_can_replace_is_refused(hand_made, trucks, cart, message):
    made = hand_made(126.0, 100.0, 1)
    supply = Supply(density=1.6, trucks=TRUCKS[:trucks])
    with pytest.raises(InvalidInput, match=message):
        serve_combines(
            made.field,
            [made.combine] * len(made.plans),
            CART,
            made.plans,
            made.swaths,
            supply,
            made.retime,
            failure=Failure(cart, 100.0),
        )
