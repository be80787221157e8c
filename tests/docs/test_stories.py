"""The public interface is documented, and comes first in the API pages."""

import importlib

from api_pages import write_api_pages
from stories import stories


def test_the_pages_tell_of_what_the_stories_offer():
    for story, offers in stories().items():
        offered = importlib.import_module(f"sightfield.{story}").__all__
        assert {each.name for each in offers} == set(offered)


def test_everything_offered_is_documented():
    nameless = [each.name for offers in stories().values() for each in offers if not each.words]
    assert nameless == []


def test_the_api_pages_begin_with_the_stories(tmp_path):
    write_api_pages(tmp_path)
    index = (tmp_path / "index.rst").read_text(encoding="utf-8")
    first, _, rest = index.partition("Systems\n-------")
    for story, offers in stories().items():
        assert f"   sightfield.{story}\n" in first
        page = (tmp_path / f"sightfield.{story}.rst").read_text(encoding="utf-8")
        assert all(f":py:obj:`{each.name} <{each.place}>`" in page for each in offers)
    assert "   sightfield.systems.tracking\n" in rest
