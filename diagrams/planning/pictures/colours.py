"""The colour of each planner, the same in plots and in the replay."""

# sRGB parts from 0 to 1.
METHOD_COLOURS: dict[str, tuple[float, float, float]] = {
    "casadi": (0.13, 0.37, 0.80),
    "extremal": (0.85, 0.33, 0.10),
    "polished": (0.83, 0.60, 0.05),
    "primitive": (0.58, 0.22, 0.64),
    "value-function": (0.10, 0.55, 0.35),
}
