#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether every source is short enough to hold one idea: lengths.py ROOT

Prints the name of each that has more than MOST lines, and exits with 1 then. Such a file is split along an idea: what
several tests use goes to tests/support, what a class does at one stage to a file of its own. Messages of the wire
stay together, however many: .proto files are not looked at.
"""

import pathlib
import sys

MOST = 350
FOLDERS = ["client", "deploy", "engine", "proto", "server", "tests"]
ENDINGS = {".c", ".cpp", ".h", ".py"}


def main():
    root = pathlib.Path(sys.argv[1])
    sources = sorted(path for folder in FOLDERS for path in (root / folder).rglob("*") if path.suffix in ENDINGS)
    if not sources:
        sys.exit(f"{root}: no sources")
    too_long = 0
    for path in sources:
        lines = len(path.read_bytes().splitlines())
        if lines > MOST:
            print(f"{path.relative_to(root)}: {lines} lines, more than {MOST}")
            too_long += 1
    print(f"{len(sources)} sources, {too_long} too long")
    return 1 if too_long else 0


if __name__ == "__main__":
    sys.exit(main())
