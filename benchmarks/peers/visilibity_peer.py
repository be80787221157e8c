"""Times VisiLibity on a job from standard input; runs in an environment of its own.

The job is JSON with `rings` (boundary counter-clockwise, holes clockwise) and `points`; the
answer has the median wall time of all polygons [s] and their areas [m^2].
"""

import json
import sys
import time

import visilibity

EPSILON = 1e-7


def main() -> None:
    """Read, time, answer."""
    job = json.load(sys.stdin)
    polygons = [
        visilibity.Polygon([visilibity.Point(x, y) for x, y in ring]) for ring in job["rings"]
    ]
    environment = visilibity.Environment(polygons)
    points = [visilibity.Point(x, y) for x, y in job["points"]]
    times = []
    for _ in range(5):
        began = time.perf_counter()
        views = [visilibity.Visibility_Polygon(each, environment, EPSILON) for each in points]
        times.append(time.perf_counter() - began)
    json.dump({"seconds": sorted(times)[2], "areas": [view.area() for view in views]}, sys.stdout)


main()
