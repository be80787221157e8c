"""A Matrix homeserver on this machine for trials: Synapse in a separate process."""

import json
import os
import secrets
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...systems.numerics.errors import SightfieldError, require, require_extra
from .accounts import make_directory, save_directory

# How long a server may take to come up, and to end [s].
_PATIENCE = 60.0
# Runs Synapse, and ends it as soon as the other end of its standard input is closed, in case the
# program that started it is killed.
_SYNAPSE = """
import os, runpy, signal, threading
def watch():
    os.read(0, 1)
    os.kill(os.getpid(), signal.SIGTERM)
threading.Thread(target=watch, daemon=True).start()
runpy.run_module("synapse.app.homeserver", run_name="__main__", alter_sys=True)
"""
# Rate limits that a trial never reaches.
_PLENTY = {"per_second": 1000, "burst_count": 1000}


class LocalServer:
    """A homeserver on loopback, without federation, that can be stopped and started again.

    Attributes:
        url: Its address.
        secret: Shared secret with which accounts are registered.

    Args:
        folder: Folder for all its data; it should be private to the user.
        port: Port on which it listens.
        settings: Settings of Synapse that replace those made here.

    Raises:
        InvalidInput: Synapse is not installed, or the port is taken.
    """

    def __init__(self, folder: Path, port: int, settings: Mapping[str, Any] | None = None) -> None:
        require_extra("`social server`", "social-server", ["synapse"])
        self._folder, self._port = folder, port
        self._process: subprocess.Popen[bytes] | None = None
        self.url, self.secret = f"http://127.0.0.1:{port}", secrets.token_urlsafe(32)
        logging = {
            "version": 1,
            "handlers": {
                "file": {"class": "logging.FileHandler", "filename": str(folder / "synapse.log")}
            },
            "root": {"level": "WARNING", "handlers": ["file"]},
        }
        (folder / "log.json").write_text(json.dumps(logging))
        config = self._settings(port) | dict(settings or {})
        # JSON is valid YAML. The file is private: with its secret, accounts can be made.
        (folder / "homeserver.yaml").touch(0o600)
        (folder / "homeserver.yaml").write_text(json.dumps(config))
        keys = [*self._command("-m", "synapse.app.homeserver"), "--generate-keys"]
        made = subprocess.run(
            keys, check=False, cwd=folder, capture_output=True, start_new_session=True
        )
        if made.returncode:
            raise SightfieldError(f"Synapse makes no keys in {folder}; ended {made.returncode}")

    def _settings(self, port: int) -> dict[str, Any]:
        """Synapse's configuration: SQLite, no federation, no limit that a trial would meet."""
        return {
            "server_name": "maze.test",
            "public_baseurl": f"{self.url}/",
            "pid_file": str(self._folder / "synapse.pid"),
            "listeners": [
                {
                    "port": port,
                    "type": "http",
                    "bind_addresses": ["127.0.0.1"],
                    "resources": [{"names": ["client"], "compress": False}],
                }
            ],
            "database": {
                "name": "sqlite3",
                "args": {"database": str(self._folder / "synapse.db")},
            },
            "log_config": str(self._folder / "log.json"),
            "media_store_path": str(self._folder / "media"),
            "signing_key_path": str(self._folder / "signing.key"),
            "registration_shared_secret": self.secret,
            "macaroon_secret_key": secrets.token_urlsafe(32),
            "form_secret": secrets.token_urlsafe(32),
            "report_stats": False,
            "trusted_key_servers": [],
            "suppress_key_server_warning": True,
            "rc_message": _PLENTY,
            "rc_login": dict.fromkeys(("address", "account", "failed_attempts"), _PLENTY),
            "rc_joins": {"local": _PLENTY, "remote": _PLENTY},
            "rc_invites": dict.fromkeys(("per_room", "per_user", "per_issuer"), _PLENTY),
            "rc_registration": _PLENTY,
            "rc_room_creation": _PLENTY,
        }

    def _command(self, *python: str) -> list[str]:
        return [sys.executable, *python, "-c", str(self._folder / "homeserver.yaml")]

    def start(self) -> None:
        """Start it, and wait until it answers.

        Raises:
            InvalidInput: Something else listens there.
            SightfieldError: It does not come up.
        """
        require(self._port_is_free(), "--port", "be free", self.url)
        with (self._folder / "output.log").open("a") as output:
            self._process = subprocess.Popen(
                self._command("-c", _SYNAPSE),
                cwd=self._folder,
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=output,
                # Ctrl-C in a terminal is for this program, which ends the server in its turn.
                start_new_session=True,
                env=os.environ | {"PYTHONUNBUFFERED": "1"},
            )
        deadline = time.monotonic() + _PATIENCE
        while time.monotonic() < deadline:
            self.check()
            if self._answers():
                return
            time.sleep(0.1)
        self.stop()
        raise SightfieldError(f"Synapse does not come up; {self._last_words()}")

    def check(self) -> None:
        """Look whether it is still there.

        Raises:
            SightfieldError: It has ended.
        """
        if self._process is not None and self._process.poll() is not None:
            raise SightfieldError(
                f"Synapse ended with {self._process.returncode}; {self._last_words()}"
            )

    def stop(self) -> None:
        """End it; what it knows stays in its folder."""
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(20)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            assert self._process.stdin is not None
            self._process.stdin.close()
            self._process = None

    def make_accounts(self, agents: int, path: Path) -> None:
        """Make accounts for a search, and write their file, readable by its owner alone.

        Args:
            agents: How many common agents.
            path: Of the file.

        Raises:
            ServerRefusal: The server does not make them.
        """
        save_directory(make_directory(self.url, self.secret, agents), path)

    def __enter__(self) -> "LocalServer":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _port_is_free(self) -> bool:
        with socket.socket() as probe:
            # A socket that was just closed there does not matter.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", self._port))
            except OSError:
                return False
        return True

    def _answers(self) -> bool:
        # Connect directly: a proxy cannot reach this machine.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            opener.open(f"{self.url}/_matrix/client/versions", timeout=5).close()
        except urllib.error.HTTPError:
            return True
        except OSError:
            return False
        return True

    def _last_words(self) -> str:
        logs = [self._folder / name for name in ("output.log", "synapse.log")]
        lines = [line for log in logs if log.exists() for line in log.read_text().splitlines()]
        return f"it said: {lines[-1][:300]}" if lines else "it said nothing"
