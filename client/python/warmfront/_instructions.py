# SPDX-License-Identifier: Apache-2.0
"""Which of the package's engines this machine is for."""
from __future__ import annotations

import os
import pathlib

PROCESSORS = pathlib.Path("/proc/cpuinfo")


def _has_avx2() -> bool:
    """Also where it cannot be known: the usual engine runs anywhere, and is slow without it."""
    try:
        with open(PROCESSORS) as processors:
            for line in processors:
                if line.startswith("flags"):
                    return "avx2" in line.split()
    except OSError:
        pass
    return True


def folders(package: list[str]) -> list[str]:
    """Where the package's modules are looked for: first in _baseline, which has an engine for x86-64 machines without AVX2, on such
    a machine, and with WARMFRONT_INSTRUCTIONS=baseline in the environment on any, to compare. Its answers are the same bits."""
    baseline = [str(folder) for folder in (pathlib.Path(path) / "_baseline" for path in package) if folder.is_dir()]
    asked = os.environ.get("WARMFRONT_INSTRUCTIONS", "")
    if asked not in ("", "baseline"):
        raise ImportError(f"WARMFRONT_INSTRUCTIONS: {asked!r}: give 'baseline', or leave it out")
    if not baseline or (not asked and _has_avx2()):
        return package
    return baseline + package
