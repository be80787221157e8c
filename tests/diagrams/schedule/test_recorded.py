"""What `sightfield schedule` says, draws and leaves is as it was recorded."""

import pytest

THREE = "--combines 3 --capacity 100 --fill-rate 1 --unload-rate 12"
FOUR = "--combines 4 --capacity 9t --fill-rate 20 --unload-rate 150"
UNEQUAL = "--combines 3 --capacity 80,100,140 --fill-rate 1,0.8,1.5 --unload-rate 10,12,11"
TRUCK = "--cart-capacity 400 --truck-travel-time 10 --truck-unload-rate 60 --truck-stop-time 5"


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (f"{THREE} --travel-time 15 --cycles 3 --fill 0.9", 0),
        (f"{THREE} --travel-time 25", 1),
        (f"{THREE} --travel-time 11 --jitter 0.2", 0),
        (f"{UNEQUAL} --travel-time 6,4 {TRUCK}", 0),
        (f"{FOUR} --travel-time 30 --carts 2", 0),
        (f"{THREE} --travel-time 5 --cart-capacity 20 --truck-travel-time 30", 1),
    ],
    ids=["in time", "too late", "with jitter", "with trucks", "two carts", "too small a cart"],
)
def test_a_schedule_is_as_recorded(words, code, as_it_was):
    as_it_was("schedule", *words.split(), code=code)


def test_the_words_for_a_machine_are_as_recorded(as_it_was):
    as_it_was("schedule", *UNEQUAL.split(), "--travel-time", "6,4", "--json", out=False)
