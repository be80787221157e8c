"""Machines are drawn as large as they are: nothing of them lies outside what the audit looks at."""

import pytest
import shapely

from sightfield.diagrams.harvest.machine_shapes import (
    auger_shape,
    body_shape,
    load_box,
    tank_box,
    tractor_shape,
)
from sightfield.systems.numerics.harvest.machines import (
    Cart,
    Combine,
    cart_outline,
    combine_outline,
)


@pytest.mark.parametrize("combine", [Combine(), Combine(header_width=6.0, length=7.0, width=3.0)])
def test_a_combine_fills_its_outline_and_no_more(combine):
    outline = shapely.Polygon(combine_outline(combine).body)
    body = body_shape(combine)
    auger = auger_shape(combine, 7.0, out=False)
    tank = shapely.box(*tank_box(combine))
    for part in (body, auger, tank):
        assert part.difference(outline).area < 1e-9
    assert body.bounds[0] == pytest.approx(-combine.length)
    assert body.bounds[3] - body.bounds[1] == pytest.approx(combine.width)
    # The spout is over the middle of the cart.
    spout = auger_shape(combine, 7.0, out=True)
    assert spout.distance(shapely.Point(0.0, 7.0)) < 1e-9
    assert spout.intersects(body)


@pytest.mark.parametrize("cart", [Cart(), Cart(length=7.0, width=3.0, hitch_offset=0.6)])
def test_a_cart_fills_its_outline_and_no_more(cart):
    outline = cart_outline(cart)
    tractor, box = shapely.Polygon(outline.tractor), shapely.Polygon(outline.trailer)
    drawn = tractor_shape(cart)
    assert drawn.difference(tractor).area < 1e-9
    assert drawn.bounds == pytest.approx(tractor.bounds)
    assert shapely.box(*load_box(cart)).difference(box).area < 1e-9
