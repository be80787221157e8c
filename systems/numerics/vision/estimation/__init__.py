"""From picture to position: coloured shells found, ranged by calibrated models, and filtered."""
