#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes `hex` of each golden message anew, from its JSON: encode.py, with the generated Python modules on PYTHONPATH."""

import importlib
import json
import pathlib

from google.protobuf import json_format, symbol_database

FILE = pathlib.Path(__file__).parent / "messages.json"


def message_of(entry: dict):
    """The message that an entry's JSON says."""
    for name in ("options", "session", "errors", "step", "collision_service", "admin_service"):
        importlib.import_module(f"warmfront.v1.{name}_pb2")
    kind = symbol_database.Default().GetSymbol("warmfront.v1." + entry["message"])
    return json_format.ParseDict(entry["json"], kind())


def main() -> None:
    entries = json.loads(FILE.read_text())
    for entry in entries:
        entry["hex"] = message_of(entry).SerializeToString(deterministic=True).hex()
    FILE.write_text(json.dumps(entries, indent=1) + "\n")


if __name__ == "__main__":
    main()
