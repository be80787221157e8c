"""The colours of the tracking scene; the thesis names most of them (2.2.8, Figure 2.24)."""

from ...visuals.lighting import paint

# Meshcat's background is shown as it is, without light.
BACKGROUND = [0.914, 0.925, 0.941]
PAPER = paint(0.985, 0.985, 0.985)
INK = paint(0.11, 0.13, 0.17)
FAINT_INK = paint(0.40, 0.44, 0.50)

OBSTACLE = paint(0.30, 0.66, 0.37)
GROWN_BOUNDARY = paint(0.95, 0.55, 0.13)

PURSUER = paint(0.13, 0.37, 0.80)
PURSUER_NOSE = paint(0.06, 0.20, 0.50)
EVADER = paint(0.85, 0.18, 0.20)
EVADER_NOSE = paint(0.52, 0.06, 0.09)
CHOSEN = paint(0.96, 0.74, 0.25)

LINE_OF_SIGHT = paint(0.06, 0.06, 0.08)
CHASE = paint(0.58, 0.22, 0.84)
POLYGON = paint(0.98, 0.86, 0.42, 0.45)
# Where an evader is lost some day: within 2 s, within 5 s, later.
LOSING = (
    paint(0.84, 0.13, 0.16, 0.60),
    paint(0.95, 0.45, 0.13, 0.50),
    paint(0.62, 0.36, 0.74, 0.40),
)
FIELD = paint(0.05, 0.52, 0.58)

IN_SIGHT = paint(0.16, 0.60, 0.30)
LOST = paint(0.80, 0.13, 0.15)
