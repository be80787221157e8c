"""What is drawn on a figure of Matplotlib: its axes, and what lies in them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text


class Drawn:
    """A figure as it was when it was saved."""

    def __init__(self, figure: Figure) -> None:
        self._told = {
            "size": figure.get_size_inches(),
            "texts": [_text(each) for each in figure.texts if each.get_text()],
            "legends": [_legend(each) for each in figure.legends],
            "axes": [_axes(each) for each in figure.axes],
        }

    def plain(self) -> dict[str, Any]:
        """For `as_recorded`."""
        return self._told


def _axes(axes: Axes) -> dict[str, Any]:
    told: dict[str, Any] = {
        "titles": [axes.get_title(loc=place) for place in ("left", "center", "right")],
        "labels": [axes.get_xlabel(), axes.get_ylabel()],
        "limits": [*axes.get_xlim(), *axes.get_ylim()],
        "scales": [axes.get_xscale(), axes.get_yscale()],
        "aspect": axes.get_aspect(),
        "shown": [axes.get_visible(), axes.axison],
        "ticks": [[each.get_text() for each in axis.get_ticklabels()] for axis in _axis(axes)],
        "legend": _legend(axes.get_legend()) if axes.get_legend() else None,
    }
    artists = [_artist(each, axes) for each in axes.get_children()]
    told["artists"] = [each for each in artists if each]
    return told


def _axis(axes: Axes) -> Iterator[Any]:
    yield from (axes.xaxis, axes.yaxis)


def _legend(legend: Any) -> list[str]:
    return [each.get_text() for each in legend.get_texts()]


def _artist(artist: Artist, axes: Axes) -> dict[str, Any] | None:
    """What an artist shows; None if it is the axes' own."""
    told: dict[str, Any]
    match artist:
        case _ if artist is axes.patch or not artist.get_visible():
            return None
        case Text():
            if not artist.get_text() or artist in _titles(axes):
                return None
            return _text(artist)
        case Line2D():
            told = {
                "line": np.column_stack([np.asarray(each, float) for each in artist.get_data()]),
                "style": [artist.get_linestyle(), str(artist.get_marker())],
                "sizes": [artist.get_linewidth(), artist.get_markersize()],
                "colour": _colour(artist.get_color()),
            }
        case Patch():
            told = {
                "patch": artist.get_path().vertices,
                "placed": artist.get_patch_transform().get_matrix(),
                "colours": [_colour(artist.get_facecolor()), _colour(artist.get_edgecolor())],
                "style": [str(artist.get_linestyle()), artist.get_hatch()],
                "sizes": [artist.get_linewidth()],
            }
        case Collection():
            array = artist.get_array()
            paths = [path.vertices for path in artist.get_paths()]
            told = {
                "collection": np.concatenate(paths or [[]]),
                "paths": np.array([len(each) for each in paths]),
                "offsets": np.ma.filled(np.ma.asarray(artist.get_offsets(), float), np.nan),
                "colours": [np.asarray(artist.get_facecolor()), np.asarray(artist.get_edgecolor())],
                "values": None if array is None else np.ma.filled(array.astype(float), np.nan),
                "clim": artist.get_clim(),
                "sizes": np.asarray(artist.get_linewidth()),
            }
        case AxesImage():
            told = {
                "image": np.ma.filled(np.ma.asarray(artist.get_array(), float), np.nan),
                "extent": artist.get_extent(),
                "clim": artist.get_clim(),
                "colours": artist.get_cmap().name,
                "origin": artist.origin,
            }
        case _:
            return None
    label = str(artist.get_label())
    return told | {
        "label": "" if label.startswith("_") else label,
        "alpha": artist.get_alpha() if np.ndim(artist.get_alpha() or 0) == 0 else "of each",
        "over": artist.get_zorder(),
    }


def _titles(axes: Axes) -> list[Any]:
    return [axes.title, getattr(axes, "_left_title", None), getattr(axes, "_right_title", None)]


def _text(text: Text) -> dict[str, Any]:
    return {
        "text": text.get_text(),
        "at": [str(each) if isinstance(each, str) else float(each) for each in text.get_position()],
        "size": text.get_fontsize(),
        "colour": _colour(text.get_color()),
        "held": [text.get_ha(), text.get_va(), text.get_rotation()],
    }


def _colour(colour: Any) -> str:
    return to_hex(colour, keep_alpha=True) if not isinstance(colour, str) else colour
