"""A real Matrix homeserver on loopback, and a line to it that can be cut and slowed."""

import asyncio
import itertools
import json
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from sightfield.hardware_io.social.accounts import SocialDirectory, make_directory
from sightfield.hardware_io.social.local_server import LocalServer
from sightfield.hardware_io.social.matrix_network import MatrixNetwork
from sightfield.systems.numerics.social.network.acceptance import OwnAcceptance, Temperaments
from sightfield.systems.numerics.social.network.interface import Answer, Picture


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Synapse(LocalServer):
    """A homeserver with a low limit on messages, which a burst of pictures meets.

    Attributes:
        port: Where it listens.
    """

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        super().__init__(folder, self.port, {"rc_message": {"per_second": 3, "burst_count": 6}})

    @contextmanager
    def down(self) -> Iterator[None]:
        """Stopped meanwhile."""
        self.stop()
        try:
            yield
        finally:
            self.start()


@pytest.fixture(scope="session")
def synapse(tmp_path_factory) -> Iterator[Synapse]:
    """A running homeserver, shared by all tests."""
    server = Synapse(tmp_path_factory.mktemp("synapse"))
    server.start()
    yield server
    server.stop()


class Line:
    """A line to a server on loopback, which can break, and can be slow.

    Attributes:
        url: Its near end.
        cut_after: Bytes that still go through towards the server in one connection before all
            connections break; None: any number. It breaks once.
        breaks: How often it broke.
        delay: Before each piece goes on [s].
    """

    def __init__(self, port: int) -> None:
        self._far, self._near = port, free_port()
        self.url = f"http://127.0.0.1:{self._near}"
        self.cut_after: int | None = None
        self.breaks, self.delay = 0, 0.0
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        serving = asyncio.start_server(self._connect, "127.0.0.1", self._near)
        self._server = asyncio.run_coroutine_threadsafe(serving, self._loop).result(10)

    async def _connect(self, reader, writer) -> None:
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._far)
        except OSError:
            writer.close()
            return
        self._writers |= {writer, far_writer}
        await asyncio.gather(
            self._carry(reader, far_writer, True), self._carry(far_reader, writer, False)
        )

    async def _carry(self, reader, writer, outwards: bool) -> None:
        passed = 0
        try:
            while piece := await reader.read(4096):
                await asyncio.sleep(self.delay)
                passed += len(piece)
                if outwards and self.cut_after is not None and passed > self.cut_after:
                    self._break()
                writer.write(piece)
                await writer.drain()
        except OSError:
            pass
        writer.close()
        self._writers.discard(writer)

    def _break(self) -> None:
        self.cut_after = None
        self.breaks += 1
        for writer in list(self._writers):
            writer.transport.abort()

    async def _end(self) -> None:
        self._server.close()
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)

    def close(self) -> None:
        asyncio.run_coroutine_threadsafe(self._end(), self._loop).result(10)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)
        self._loop.close()


@pytest.fixture
def line(synapse) -> Iterator[Line]:
    """A line to the homeserver."""
    between = Line(synapse.port)
    yield between
    between.close()


@pytest.fixture(scope="session")
def eventually() -> Callable[..., None]:
    """A function that waits until a condition holds, and fails if it never does."""

    def wait(holds: Callable[[], object], patience: float = 30.0) -> None:
        deadline = time.monotonic() + patience
        while not holds():
            assert time.monotonic() < deadline, "it never came true"
            time.sleep(0.02)

    return wait


class Maze:
    """What tests of the network on a homeserver share.

    Attributes:
        synapse: The homeserver.
        eventually: Waits for a condition.
    """

    _numbers = itertools.count()

    def __init__(self, synapse: Synapse, eventually: Callable[..., None]) -> None:
        self.synapse, self.eventually = synapse, eventually

    def directory(self, agents: int = 1) -> SocialDirectory:
        """Fresh accounts."""
        prefix = f"test{next(self._numbers)}"
        return make_directory(self.synapse.url, self.synapse.secret, agents, prefix=prefix)

    def always(self, friending=(1.0,), unfriending=(0.0,), rejection=(0.0,)) -> Temperaments:
        """By default one agent, who accepts when it gets to it."""
        return Temperaments(
            acceptance=OwnAcceptance(tuple(friending)),
            unfriending=tuple(unfriending),
            rejection=tuple(rejection),
        )

    def picture(self, agent: int, number: int, size: int = 2000) -> Picture:
        """The same for the same numbers."""
        data = np.random.default_rng([agent, number]).bytes(size)
        return Picture(id=f"{agent}/{number}", agent=agent, time=number / 10, data=data)

    def befriend(self, network: MatrixNetwork, *agents: int) -> None:
        """Ask agents until all are friends."""
        for agent in agents:
            network.request(agent)

        def accepted() -> bool:
            network.advance(0)
            return network.friends() >= set(agents)

        self.eventually(accepted)

    def answers(self, network: MatrixNetwork) -> list[tuple[int, Answer]]:
        """New responses as pairs."""
        return [(each.agent, each.answer) for each in network.responses()]

    def ids(self, network: MatrixNetwork, agent: int = 0) -> list[str]:
        """Names of the pictures that are here, newest first."""
        return [each.id for each in network.latest(agent, 16)]

    def call(self, method: str, path: str, body: dict, token: str | None) -> None:
        """What any other program of an account's owner might do to a room."""
        headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        address = f"{self.synapse.url}/_matrix/client/v3/rooms/{path}"
        data = json.dumps(body).encode()
        request = urllib.request.Request(address, data, headers, method=method)
        urllib.request.urlopen(request, timeout=30).close()


@pytest.fixture
def maze(synapse, eventually) -> Maze:
    """A homeserver, and what to do there."""
    return Maze(synapse, eventually)
