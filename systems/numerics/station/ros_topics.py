"""The ROS 2 topics on which poses of robots arrive."""

from ..errors import require, require_one_of

# Default topic of each message.
USUAL_TOPICS = {"PoseStamped": "{body}/pose", "Odometry": "{body}/odom", "tf": "tf"}


def pose_topic(message: str, topic: str, domain: int) -> str:
    """The topic of a message, with {body} for a body's name where each has one of its own.

    Args:
        message: One of USUAL_TOPICS.
        topic: Its name; empty: the usual one.
        domain: Number of the domain (ROS_DOMAIN_ID).

    Raises:
        InvalidInput: The message is another, the topic lacks {body} or must not have it, or the
            domain is out of its range.
    """
    require_one_of("message", message, USUAL_TOPICS)
    require(0 <= domain <= 232, "domain", "be 0 to 232", domain)
    named = (topic or USUAL_TOPICS[message]).strip("/")
    shared = message == "tf"
    wish = "have no {body}, as tf is for all" if shared else "have {body} in it"
    require(shared != ("{body}" in named), "topic", wish, topic)
    return named
