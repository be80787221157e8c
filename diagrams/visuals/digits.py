"""A number that changes: at every place the ten digits wait, and one of them is shown."""

from pydrake.geometry import Rgba

from .stage import Stage
from .text import advance, text_mesh


class Digits:
    """Shows numbers from 0 up at `PATH/PLACE/DIGIT`; place 0 is the rightmost.

    Numbers that are too large show as all nines.
    """

    def __init__(
        self,
        stage: Stage,
        path: str,
        height: float,
        colour: Rgba,
        *,
        places: int,
        decimals: int = 0,
    ) -> None:
        """Make room for `places` digits, `decimals` of them after a point.

        Args:
            stage: Where to draw.
            path: The first digit's baseline begins at its origin.
            height: Of a digit [m].
            colour: Of the digits.
            places: Number of digits.
            decimals: Number of digits after the point.
        """
        self._stage = stage
        self._path = path
        self._places = places
        self._decimals = decimals
        self._shown: list[int | None] = [None] * places
        self._whole: int | None = None
        step = advance("0", bold=True) * height
        point = advance(".", bold=True) * height if decimals else 0.0
        for place in range(places):
            x = step * (places - 1 - place) + (point if place < decimals else 0.0)
            stage.place(f"{path}/{place}", x, 0.0)
            for digit in range(10):
                stage.mesh(
                    f"{path}/{place}/{digit}", text_mesh(str(digit), height, bold=True), colour
                )
                stage.show(f"{path}/{place}/{digit}", False)
        if decimals:
            stage.mesh(f"{path}/point", text_mesh(".", height, bold=True), colour)
            stage.place(f"{path}/point", step * (places - decimals), 0.0)
        self.width = step * places + point

    def show(self, number: float) -> None:
        """Show a number, cut off after its last decimal, without leading zeros."""
        whole = min(int(number * 10**self._decimals + 1e-6), 10**self._places - 1)
        if whole == self._whole:
            return
        self._whole = whole
        for place in range(self._places):
            digit = whole // 10**place % 10
            leading = whole < 10**place and place > self._decimals
            wanted = None if leading else digit
            before = self._shown[place]
            if wanted != before:
                if before is not None:
                    self._stage.show(f"{self._path}/{place}/{before}", False)
                if wanted is not None:
                    self._stage.show(f"{self._path}/{place}/{wanted}", True)
                self._shown[place] = wanted
