"""What stands at the address of a live page."""

import re
import time
import urllib.error
import urllib.request

import pytest
from pydrake.geometry import Meshcat

from sightfield.diagrams.visuals.live_page import open_live_page


def get(url: str) -> bytes:
    with urllib.request.urlopen(url, timeout=10) as answer:
        return answer.read()


@pytest.fixture(scope="module")
def live():
    return open_live_page(port=0)


def test_the_page_is_drakes_with_one_script_more(live):
    behind = Meshcat.web_url(live)
    page, drakes = get(live.web_url()).decode(), get(behind).decode()
    assert "<title>Sightfield</title>" in page
    assert live.web_url() != behind
    for line in drakes.splitlines():
        assert line.strip() in page or "<title>" in line
    assert 100 < len(page) - len(drakes) < 2000


def test_what_the_page_loads_is_passed_on_as_it_is(live):
    script = re.search(r'src="(cas[^"]*)"', get(live.web_url()).decode())
    assert script is not None
    passed_on = get(f"{live.web_url()}/{script[1]}")
    assert passed_on == get(f"{Meshcat.web_url(live)}/{script[1]}")
    assert len(passed_on) > 100_000


def test_what_is_not_there_is_not_found(live):
    with pytest.raises(urllib.error.HTTPError, match="404"):
        get(f"{live.web_url()}/nothing")


def test_a_port_that_is_taken_is_said_to_be(live):
    with pytest.raises(RuntimeError, match=f"port {live.port()}: "):
        open_live_page(port=live.port())


def test_a_page_that_nobody_holds_gives_up_its_port():
    page = open_live_page(port=0)
    address = page.web_url()
    assert get(address)
    del page
    until = time.monotonic() + 20.0
    while time.monotonic() < until:
        try:
            get(address)
        except OSError:
            return
        time.sleep(0.1)
    pytest.fail("it still answers")
