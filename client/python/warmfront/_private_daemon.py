# SPDX-License-Identifier: Apache-2.0
"""A daemon of this process's own: found, started on a Unix socket that only this user can open, and ended with this process,
however that ends. Thread-safe."""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import weakref
from collections.abc import Sequence
from typing import IO, Optional

from .errors import UnavailableError

# The shell's standard input is a pipe whose other end is this process's alone: it is closed when the process ends, by
# whatever, and the daemon is ended then. (A signal at the parent's death would come already when the thread ends that
# started the daemon.) Nobody else uses the daemon: what is in hand by then is given up soon.
_KEEPER = """
exec 3<&0 </dev/null
"$@" 3<&- &
daemon=$!
{ read -r _ <&3; kill "$daemon"; sleep 5; kill -KILL "$daemon"; } >/dev/null 2>&1 &
watcher=$!
exec 3<&-
wait "$daemon"
status=$?
kill "$watcher" 2>/dev/null
wait "$watcher"  # so that nothing of it is there when this ends
rm -rf "$0"
exit $status
"""
_FLAGS = ("--log-level", "warning", "--drain-timeout", "200ms", "--idle-timeout", "24h")
# Of the path of a Unix socket, with room for its name.
_LONGEST_FOLDER = 90
_POLL = 0.005
# For the daemon to end; it is killed after half of this.
_END = 10.0


def find_program() -> str:
    """The path of warmfrontd: $WARMFRONTD, beside this package (as built or installed), or in PATH. UnavailableError where
    there is none."""
    named = os.environ.get("WARMFRONTD")
    if named:
        if not os.access(named, os.X_OK) or os.path.isdir(named):
            raise UnavailableError(f"$WARMFRONTD is {named}, which is no program that can be run")
        return named
    package = pathlib.Path(__file__).resolve().parent
    # Wheel: warmfront/bin. Build: python/warmfront and bin. Installed: lib/python3/dist-packages/warmfront and bin.
    beside = [folder / "bin" / "warmfrontd" for folder in (package, *package.parents[1:4])]
    for path in beside:
        if os.access(path, os.X_OK):
            return str(path)
    found = shutil.which("warmfrontd")
    if found is None:
        raise UnavailableError("no address was given, and there is no warmfrontd to start: neither $WARMFRONTD, nor "
                               f"{', '.join(map(str, beside))}, nor one in PATH; install it, or give a daemon's address")
    return found


class PrivateDaemon:
    """Ends with this object too, and at `end()`."""

    def __init__(self, flags: Sequence[str], timeout: float) -> None:
        """Returns when it listens. flags: of its command line, besides the address; WARMFRONT_* variables are not passed
        on. UnavailableError, with what it said last, where it is not found, ends, or does not listen within `timeout`
        seconds."""
        program = find_program()
        parent = tempfile.gettempdir()
        folder = tempfile.mkdtemp(prefix="warmfront-", dir=parent if len(parent) < _LONGEST_FOLDER else "/tmp")
        self._socket = os.path.join(folder, "d.sock")
        self._log: IO[bytes] = tempfile.TemporaryFile()
        command = [program, "--listen", self.address, *_FLAGS, *flags]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("WARMFRONT_")}
        try:
            process = subprocess.Popen(["/bin/sh", "-c", _KEEPER, folder, *command], stdin=subprocess.PIPE,
                                       stdout=self._log, stderr=self._log, env=environment, start_new_session=True)
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            raise UnavailableError(f"{program} could not be started: {error.strerror}") from None
        self._process = process
        self._end = weakref.finalize(self, _end, process, self._log)
        try:
            self._wait(program, timeout)
        except BaseException:
            self.end()
            raise

    @property
    def address(self) -> str:
        return f"unix:{self._socket}"

    def end(self) -> None:
        """Again: nothing."""
        self._end()

    def why_ended(self) -> Optional[str]:
        """What it said last, where it has ended; else None."""
        return None if self._process.poll() is None else self._said()

    def _wait(self, program: str, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while not os.path.exists(self._socket):
            if self._process.poll() is not None:
                raise UnavailableError(f"{program} was started and ended at once: {self._said()}")
            if time.monotonic() >= deadline:
                raise UnavailableError(f"{program} was started and does not listen after {timeout:g} s: {self._said()}")
            time.sleep(_POLL)

    def _said(self) -> str:
        """The end of its log."""
        if self._log.closed:
            return "it was ended with its client"
        size = os.fstat(self._log.fileno()).st_size
        text = os.pread(self._log.fileno(), 2000, max(size - 2000, 0)).decode("utf-8", "replace").strip()
        return "; ".join(text.splitlines()[-3:]) or f"it said nothing (exit status {self._process.returncode})"


def _end(process: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    log.close()
    assert process.stdin is not None
    process.stdin.close()
    try:
        process.wait(_END)
    except subprocess.TimeoutExpired:
        process.kill()  # the keeper alone: its watcher goes on and ends the daemon
        process.wait()
