"""Trying again: what a homeserver does not do now is done later, unless it says no for good."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Any

import aiohttp
import nio

from .provisioning import ServerRefusal

_LOG = logging.getLogger(__name__)

# Waits after failures in a row [s], the last one again and again.
_WAITS = (0.1, 0.2, 0.5, 1.0, 2.0)

# No call takes longer, or it has hung [s]; a sync waits for news for part of it.
_LONGEST_CALL = 60.0

# Answers that another attempt may change, though they are the client's fault by their number.
_PASSING = {408, 425, 429}


def make_client(homeserver: str, user: str, token: str) -> nio.AsyncClient:
    """A client that leaves trying again to `persist`.

    Args:
        homeserver: Its address.
        user: Name of the account.
        token: Its access token.
    """
    config = nio.AsyncClientConfig(
        max_limit_exceeded=0, max_timeouts=0, request_timeout=30, encryption_enabled=False
    )
    client = nio.AsyncClient(homeserver, user, config=config)
    client.user_id, client.access_token = user, token
    return client


async def persist(call: Callable[[], Awaitable[Any]], what: str) -> Any:
    """Make a call until it succeeds.

    Args:
        call: Makes one attempt; must be harmless if an earlier one succeeded unnoticed.
        what: For the log and for errors.

    Returns:
        The response, never an error.

    Raises:
        ServerRefusal: The server says no for good.
    """
    failures = 0
    while True:
        wait = _WAITS[min(failures, len(_WAITS) - 1)]
        try:
            async with asyncio.timeout(_LONGEST_CALL):
                response = await call()
        # OSError covers connections refused and reset, and time-outs.
        except (aiohttp.ClientError, OSError) as error:
            reason = f"{type(error).__name__} {error}".strip()
        else:
            if not isinstance(response, nio.ErrorResponse):
                return response
            reason = f"{response.status_code} {response.message}".strip()
            if _is_final(response):
                raise ServerRefusal(f"the homeserver refuses to {what}: {reason}")
            wait = max(wait, (response.retry_after_ms or 0) / 1000)
        failures += 1
        _LOG.info("Trying to %s again in %.2f s: %s", what, wait, reason)
        await asyncio.sleep(wait)


def _is_final(response: nio.ErrorResponse) -> bool:
    """Whether an error is the client's fault, and will be the same next time."""
    transport: Any = response.transport_response
    if response.status_code == "M_LIMIT_EXCEEDED" or transport is None:
        return False
    return 400 <= transport.status < 500 and transport.status not in _PASSING
