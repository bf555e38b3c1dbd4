# SPDX-License-Identifier: Apache-2.0
"""connect() without an address: a daemon of the process's own, which ends with it, however it ends."""
import gc
import os
import pathlib
import signal
import subprocess
import sys
import threading

import pytest
from conftest import BIN
from support import bits, eventually, triangle_through_triangle

import warmfront
from warmfront import FailedPreconditionError, InvalidArgumentError, Security, Timeouts, UnavailableError

BEFORE, AFTER, FACES = triangle_through_triangle()


@pytest.fixture(autouse=True)
def named(monkeypatch):
    monkeypatch.setenv("WARMFRONTD", str(BIN / "warmfrontd"))


def folder_of(address):
    return pathlib.Path(address.removeprefix("unix:")).parent


def runs(address):
    """Whether a process has the socket's path on its command line."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if address.encode() in (process / "cmdline").read_bytes():
                return True
        except OSError:
            pass
    return False


def address_of(session):
    return session._link.connection.address


def test_a_session_of_a_daemon_that_is_started_for_it(client):
    with client.session(BEFORE, FACES) as session:
        expected = bits(session.step(AFTER))
    with warmfront.connect(flags=["--threads", "1"]) as own:
        assert own.server_info().threads == 1
        with own.session(BEFORE, FACES) as session:
            assert bits(session.step(AFTER)) == expected
            address = address_of(session)
            assert runs(address) and oct(folder_of(address).stat().st_mode & 0o777) == "0o700"
    assert not runs(address) and not folder_of(address).exists()


def test_a_session_that_was_not_closed_is_not_said_to_stay():
    with warmfront.connect() as own:
        session = own.session(BEFORE, FACES)
        with pytest.warns(ResourceWarning, match=f"^session {session.id} was not closed: use `with`"):
            del session


def test_it_ends_with_the_last_that_uses_it():
    with warmfront.connect().session(BEFORE, FACES) as session:
        gc.collect()  # the client is gone
        assert len(session.step(AFTER)) == 3
        address = address_of(session)
    del session
    gc.collect()
    eventually(lambda: not runs(address) and not folder_of(address).exists())


def test_two_have_daemons_of_their_own():
    with warmfront.connect() as one, warmfront.connect() as other, one.session(BEFORE, FACES):
        assert len(one.list_sessions()) == 1 and other.list_sessions() == []


def test_it_outlives_the_thread_that_started_it():
    made = []
    thread = threading.Thread(target=lambda: made.append(warmfront.connect()))
    thread.start()
    thread.join()
    with made[0] as client, client.session(BEFORE, FACES) as session:
        assert len(session.step(AFTER)) == 3 and session.resumes == 0


PROGRAM = """
import os, sys, numpy as np, warmfront
session = warmfront.connect().session(np.eye(3), [[0, 1, 2]])
print(session._link.connection.address, flush=True)
{end}
"""


@pytest.mark.parametrize("end", ["os._exit(3)", "sys.exit()", "raise KeyboardInterrupt", "os.abort()", "sys.stdin.read()"])
def test_it_ends_with_the_process(end):
    process = subprocess.Popen([sys.executable, "-c", PROGRAM.format(end=end)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    address = process.stdout.readline().strip()
    if "stdin" in end:
        assert runs(address)
        process.kill()
    process.communicate()
    eventually(lambda: not runs(address) and not folder_of(address).exists())


def test_what_interrupts_the_terminal_does_not_end_it():
    """Control-C reaches all processes of the terminal's group; a program may go on after it."""
    end = "os.killpg(0, 2) if signal.signal(2, lambda *_: None) else 0; print(len(session.step(np.eye(3))), flush=True)"
    done = subprocess.run([sys.executable, "-c", "import signal" + PROGRAM.format(end=end)], stdout=subprocess.PIPE,
                          text=True, start_new_session=True)
    assert done.returncode == 0 and done.stdout.splitlines()[1:] == ["0"]


def test_the_environment_of_a_daemon_does_not_reach_it(monkeypatch):
    monkeypatch.setenv("WARMFRONT_TOKEN_FILE", "/no/such/file")
    with warmfront.connect() as client:
        assert client.server_info().sessions == 0


def test_there_is_none(monkeypatch, tmp_path):
    monkeypatch.setenv("WARMFRONTD", str(tmp_path / "nothing"))
    with pytest.raises(UnavailableError, match=r"\$WARMFRONTD is .*nothing, which is no program"):
        warmfront.connect()
    monkeypatch.delenv("WARMFRONTD")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("warmfront._private_daemon.__file__", str(tmp_path / "a/b/c/d/e.py"))
    with pytest.raises(UnavailableError, match="no address was given, and there is no warmfrontd to start: neither"):
        warmfront.connect()


@pytest.mark.parametrize("where", ["x/python/warmfront", "x/lib/python3/dist-packages/warmfront"])
def test_it_is_found_beside_the_package_or_in_the_path(monkeypatch, tmp_path, where):
    monkeypatch.delenv("WARMFRONTD")
    monkeypatch.setattr("warmfront._private_daemon.__file__", str(tmp_path / where / "_private_daemon.py"))
    (tmp_path / "x/bin").mkdir(parents=True)
    (tmp_path / "x/bin/warmfrontd").symlink_to(BIN / "warmfrontd")
    with warmfront.connect() as client:
        assert client.server_info().sessions == 0
    monkeypatch.setattr("warmfront._private_daemon.__file__", str(tmp_path / "a/b/c/d/e.py"))
    monkeypatch.setenv("PATH", f"{tmp_path}/x/bin:{os.environ['PATH']}")
    with warmfront.connect() as client:
        assert client.server_info().sessions == 0


def test_it_does_not_start(tmp_path, monkeypatch):
    with pytest.raises(UnavailableError, match="was started and ended at once: .*--no-such-flag"):
        warmfront.connect(flags=["--no-such-flag"])
    silent = tmp_path / "silent"
    silent.write_text("#!/bin/sh\nexec sleep 600\n")
    silent.chmod(0o755)
    monkeypatch.setenv("WARMFRONTD", str(silent))
    with pytest.raises(UnavailableError, match="does not listen after 0.3 s"):
        warmfront.connect(timeouts=Timeouts(call=0.3))


def test_it_is_lost():
    with warmfront.connect() as client, pytest.raises(UnavailableError, match="started for this client has ended"):
        session = client.session(BEFORE, FACES)
        os.killpg(session._link.connection._private._process.pid, signal.SIGKILL)
        session.step(AFTER)


# Found by a user: it waited for as long as an upload may take.
def test_a_new_session_of_one_that_is_lost():
    with warmfront.connect() as client:
        session = client.session(BEFORE, FACES)
        os.killpg(session._link.connection._private._process.pid, signal.SIGKILL)
        with pytest.raises(UnavailableError, match="started for this client has ended") as error:
            client.session(BEFORE, FACES)
        assert error.value.reason == "DAEMON_ENDED"


def test_it_ends_with_a_session_that_was_lost():
    with warmfront.open(BEFORE, FACES, server="local") as session:
        connection = session._link.connection
        os.killpg(connection._private._process.pid, signal.SIGKILL)
        with pytest.raises(UnavailableError):
            session.step(AFTER)
        assert connection._private._end.alive
    assert not connection._private._end.alive
    with pytest.raises(FailedPreconditionError, match="the client is closed"):
        connection.get(session.id)


def test_what_does_not_go_together():
    with pytest.raises(InvalidArgumentError, match="give an address or no security"):
        warmfront.connect(security=Security(tls=True))
    with pytest.raises(InvalidArgumentError, match="either an address or flags"):
        warmfront.connect("127.0.0.1:1", flags=["--threads", "1"])


def test_a_client_that_was_closed():
    client = warmfront.connect()
    session = client.session(BEFORE, FACES)
    client.close()
    client.close()
    with pytest.raises((FailedPreconditionError, UnavailableError)):
        session.step(AFTER)
