# SPDX-License-Identifier: Apache-2.0
"""The pages' commands, line by line, in a folder that holds what they name: on small scenes, for a short while, and with
daemons of the test's own in the place of those that the pages start."""
import os
import re
import shutil
import signal
import subprocess

import pytest
from conftest import free_port, serves
from pages import ADDRESS, BIN, BLOCKS, PAGES, SOURCE

# What takes minutes, changes the machine, or is this test: that it is there is all that is looked at. By the command's first word.
ONLY_LOOKED_UP = {
    "cmake", "conan", "cpack", "ctest", "export", "git", "kubectl", "ninja", "podman", "sbatch", "scancel", "srun",
    "systemctl", "vcpkg",  # tools
}

# A shorter way to say the same of less.
SHORTER = [
    (r"(?<![\"\w])builtin:([a-z-]+)(?!\S)", r"'builtin:\1?triangles=1000&frames=4'"),
    (r"builtin:([a-z-]+)\?triangles=\d+&frames=\d+", r"builtin:\1?triangles=1000&frames=4"),
    (r"--triangles \d+", "--triangles 1000"),
    (r"--duration \S+", "--duration 300ms"),
    (r"--sessions \d+:\d+:", "--sessions 1:2:"),
    (r"--sessions \d+(?!\S)", "--sessions 2"),
    (r"--rounds \d+", "--rounds 1"),
    (r"--frames 60:74", "--frames 1:3"),  # of the few frames that there are
    (r"tests/bench/figures", "figures"),
]


def lines_of(page):
    """The page's commands, continued lines joined, without comments."""
    for kind, text in BLOCKS[page]:
        if kind == "sh":
            for line in text.replace("\\\n", " ").splitlines():
                command = re.sub(r"(^|\s)#.*", "", line).strip()
                if command:
                    yield command


def first_word(command):
    """What is run, behind variables that are set for it."""
    return next(word for word in command.split() if not re.match(r"[A-Z_]+=", word))


def shorter(command):
    for pattern, instead in SHORTER:
        command = re.sub(pattern, instead, command)
    if re.search(r"\bwarmfront load\b", command):
        command += "" if "--duration" in command else " --duration 300ms"
        command += " --warmup 0s"
    if re.search(r"\bwarmfront (bench|accuracy)\b", command) and not re.search("--rounds|--span", command):
        command += " --rounds 1"
    return command


def look_up(command):
    """Fails where the command names a program, a test or a table that is not there."""
    word = first_word(command)
    if word in ONLY_LOOKED_UP:
        return
    if "/" in word:
        assert os.access(SOURCE / word, os.X_OK), f"{word} is not there: {command}"
    else:
        targets = "".join(lists.read_text() for lists in (SOURCE / "tests").rglob("CMakeLists.txt"))
        assert re.search(rf"\b{word}\b", targets), f"{word} is neither run here nor known: {command}"
    if word == "tests/bench/tables.py":
        known = (SOURCE / word).read_text()
        for table in command.split("bin/warmfront")[1].split():
            assert f'"{table}"' in known or f"def {table}" in known, f"{table}: {command}"


def start_and_stop(command, folder):
    """A daemon as the page starts it, but for its ports."""
    ports = {}
    def moved(found):
        ports[found.group(1)] = ports.get(found.group(1)) or free_port()
        return f"127.0.0.1:{ports[found.group(1)]}"
    command = re.sub(r"(?:127\.0\.0\.1|0\.0\.0\.0):(\d+)", moved, command.rstrip("& "))
    daemon = subprocess.Popen(["sh", "-c", "exec " + command], cwd=folder, stderr=subprocess.PIPE,
                              env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
    try:
        places = [*ports.values(), *(folder / path for path in re.findall(r"--listen unix:([^\s,]+)", command))]
        assert places and all(serves(place) for place in places), command
        daemon.send_signal(signal.SIGTERM)
        _, said = daemon.communicate(timeout=60)
        assert daemon.returncode == 0, said.decode()
    finally:
        daemon.kill()
        daemon.wait()


@pytest.mark.parametrize("page", [page for page in PAGES if any(lines_of(page))], ids=lambda page: str(page.relative_to(SOURCE)))
def test_commands(page, sandbox, address, guarded):
    port, metrics = guarded
    for line in lines_of(page):
        word = first_word(line)
        if word == "warmfrontd" and "--listen" in line:
            start_and_stop(line, sandbox)
        elif re.search(r"(^|[/ ])warmfrontd?$|^curl$|\.py$", word) and not word.startswith("tests/"):
            if word == "curl" and not shutil.which("curl"):
                continue
            command = shorter(line).replace(ADDRESS, address).replace("127.0.0.1:9464", f"127.0.0.1:{metrics}")
            command = re.sub(r"--server unix:\S+", f"--server {address}", command)
            command = command.replace("HOST:50052", f"127.0.0.1:{port}" if "--tls-ca" in command else address)
            if "client/python/examples/" in word:  # tests/unit/client/python/test_example.py runs them
                assert (SOURCE / word).exists()
                continue
            done = subprocess.run(["sh", "-c", command], cwd=sandbox, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "WARMFRONT_DATA": f"{sandbox}/data"})
            # Whether a busy machine keeps a limit on latency is not what is tested.
            fine = (0, 1) if re.search("--limit|--knee", command) else (0,)
            assert done.returncode in fine, f"{command}\n{done.stdout}{done.stderr}"
        else:
            look_up(line)


def test_no_two_commands_start_daemons_on_one_port_of_a_page():
    for page in PAGES:
        ports = []
        for line in lines_of(page):
            for started in re.findall(r"(?:^|[;&|] *)warmfrontd\b([^;&|]*)", line):
                ports += [address.rpartition(":")[2] for address in re.findall(r"--listen (\S+)", started)]
        assert len(set(ports)) == len(ports), (page, ports)
