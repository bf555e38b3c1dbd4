# SPDX-License-Identifier: Apache-2.0
"""The programs that a wheel brings, as commands of its environment."""
from __future__ import annotations

import os
import pathlib
import sys
from typing import NoReturn


def _become(name: str) -> NoReturn:
    program = pathlib.Path(__file__).resolve().parent / "bin" / name
    os.execv(program, [str(program), *sys.argv[1:]])


def warmfront() -> NoReturn:
    _become("warmfront")


def warmfrontd() -> NoReturn:
    _become("warmfrontd")
