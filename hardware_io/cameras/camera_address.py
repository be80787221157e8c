"""Addresses of cameras, fit to be shown."""

import re


def without_password(place: str) -> str:
    """An address without the name, password and parameters that let one look through the camera.

    Args:
        place: Of a camera, as "0" or "rtsp://name:password@camera/stream?token=secret".
    """
    scheme, mark, rest = place.partition("://")
    if not mark:
        return place
    # A password may have any character that its camera takes, "@" and "/" among them.
    before, at, after = rest.rpartition("@")
    address = f"***@{after}" if at and before else rest
    return f"{scheme}://{re.sub(r'[?#;].*', '?***', address, flags=re.DOTALL)}"
