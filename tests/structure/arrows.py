#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the includes between folders run one way: arrows.py ROOT [--list]

Each room below may include those before it, in its own list (the engine's or the server's), and none after it. Prints
what includes upward, and exits with 1 then. With --list it prints every arrow and how many includes it stands for. To
add a room, put it at its place in ROOMS or SERVER_ROOMS; to draw an arrow the other way, move the code instead.
"""

import collections
import pathlib
import re
import sys

# From the ground up. `engine/*.h` are the engine's public headers: plain values and contracts, which every room may
# include; `engine/*.cpp` implement them and may include every room.
ROOMS = [
    "engine/parallel",
    "engine/simd",
    "engine/scene",
    "engine/motion",
    "engine/elementary/exact",
    "engine/elementary",
    "engine/bounds",
    "engine/bvh",
    "engine/broad_phase",
    "engine/front",
    "engine/narrow_phase",
    "engine/state",
    "engine/check",
    "engine/step",
]
PUBLIC = "engine"
# The same of the server, between what stands at its top: below them words that all use, above them the daemon.
SERVER_WORDS = {"server/annotations.h", "server/fault.h", "server/log.h", "server/units.h"}
SERVER_ROOMS = ["server/process", "server/session", "server/auth", "server/observe", "server/transport"]
# Folders by who may include whom: the engine knows nobody, the programs know it.
MAY_INCLUDE = {
    "engine": {"engine"},
    "proto": {"proto", "engine"},  # recordings answer with the engine's Result
    "server": {"server", "engine", "proto"},
    "client": {"client", "engine", "proto"},
    "tests": {"tests", "server", "client", "engine", "proto"},
}
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def room_of(path):
    """The deepest room that a file is in; its folder where that is none."""
    folder = path.rpartition("/")[0]
    while folder and folder not in ROOMS + SERVER_ROOMS and folder != PUBLIC:
        folder = folder.rpartition("/")[0]
    return folder or path.split("/")[0]


def server_floor(path):
    """How high a file of the server stands."""
    if path.replace(".cpp", ".h") in SERVER_WORDS:
        return -1
    folder = path.rpartition("/")[0]
    return SERVER_ROOMS.index(folder) if folder in SERVER_ROOMS else len(SERVER_ROOMS)


def is_upward(source, target):
    """Does an include of `target` in `source` (paths from the root) run against the order?"""
    of, to = source.split("/")[0], target.split("/")[0]
    if to not in MAY_INCLUDE.get(of, {to}):
        return True
    if of == to == "server":
        return server_floor(target) > server_floor(source)
    if of != "engine":
        return False
    room, other = room_of(source), room_of(target)
    if room == PUBLIC:  # a public header pulls in no room; its source may
        return source.endswith(".h") and other != PUBLIC
    return other != PUBLIC and ROOMS.index(other) > ROOMS.index(room)


def files(root):
    for top in MAY_INCLUDE:
        for path in sorted((root / top).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                yield path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")


def main(root, listing):
    arrows = collections.Counter()
    upward = []
    for source, text in files(root):
        for target in INCLUDE.findall(text):
            if not (root / target).exists():  # generated, or another project's
                continue
            if is_upward(source, target):
                upward.append(f"{source} includes {target}")
            if room_of(source) != room_of(target):
                arrows[room_of(source), room_of(target)] += 1
    if listing:
        for (source, target), count in sorted(arrows.items()):
            print(f"{source} -> {target}: {count}")
    for line in upward:
        print(line, file=sys.stderr)
    print(f"{sum(arrows.values())} includes between rooms, {len(upward)} of them upward")
    return 1 if upward else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), "--list" in sys.argv))
