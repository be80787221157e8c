"""Pictures wait in the outbox in their order, whole, until they are done."""

from sightfield.hardware_io.social.common_agents import Outbox
from sightfield.systems.numerics.social.network.interface import Picture


def picture(number):
    return Picture(id=f"0/{number}", agent=0, time=number / 8, data=b"line\nline\n\x00" * number)


def test_pictures_are_kept_in_their_order_until_they_are_done(tmp_path):
    outbox = Outbox(tmp_path / "new")
    for number in range(12):
        outbox.keep(picture(number), "run")
    outbox.done(picture(3), "run")
    outbox.done(picture(4), "another run")
    left = [(picture(number), "run") for number in range(12) if number != 3]
    assert outbox.waiting() == left
    again = Outbox(tmp_path / "new")
    again.keep(picture(20), "next")
    assert again.waiting() == [*left, (picture(20), "next")]


def test_a_file_half_written_is_not_there_and_one_that_is_spoilt_is_left_alone(tmp_path):
    outbox = Outbox(tmp_path)
    outbox.keep(picture(1), "run")
    (tmp_path / "0000000002-abc.new").write_bytes(b'{"id": ')
    (tmp_path / "0000000003-abc.picture").write_bytes(b"garbage")
    (tmp_path / "0000000004-abc.picture").write_bytes(b'{"id": "x"}\n')
    assert Outbox(tmp_path).waiting() == [(picture(1), "run")]


def test_without_a_folder_nothing_is_kept():
    outbox = Outbox(None)
    outbox.keep(picture(1), "run")
    outbox.done(picture(1), "run")
    assert outbox.waiting() == []
