"""The colours of controllers and of marks, the same in all pictures."""

CONTROLLER_COLOURS = {"P": "#215fcc", "PI": "#d9722e", "PD": "#178a5a", "PID": "#8b3fa8"}
REGION, CERTIFIED = "#dcecdc", "#178a5a"
SINGULAR = "#c62828"
BORDER = "#333333"
REFERENCE = "#888888"
CALIBRATED = "#fff3cf"
EVADER, PURSUER = "#d92e33", "#215fcc"
