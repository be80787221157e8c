"""Topics of poses: those that are usual, those that are given, and what neither may be."""

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.ros_topics import pose_topic


@pytest.mark.parametrize(
    ("message", "topic", "named"),
    [
        ("PoseStamped", "", "{body}/pose"),
        ("Odometry", "", "{body}/odom"),
        ("tf", "", "tf"),
        ("PoseStamped", "/vrpn/{body}/", "vrpn/{body}"),
        ("tf", "/tf_static", "tf_static"),
    ],
)
@pytest.mark.parametrize("domain", [0, 232])
def test_a_topic_is_the_usual_one_or_the_one_that_is_given(message, topic, named, domain):
    assert pose_topic(message, topic, domain) == named


@pytest.mark.parametrize(
    ("message", "topic", "domain", "says"),
    [
        ("Twist", "", 0, "`message`"),
        ("PoseStamped", "pose", 0, "`topic` must have {body} in it; got pose"),
        ("tf", "{body}/tf", 0, "`topic` must have no {body}, as tf is for all"),
        ("tf", "", -1, "`domain` must be 0 to 232; got -1"),
        ("tf", "", 233, "`domain` must be 0 to 232; got 233"),
    ],
)
def test_other_topics_are_refused(message, topic, domain, says):
    with pytest.raises(InvalidInput, match=says):
        pose_topic(message, topic, domain)
