# SPDX-License-Identifier: Apache-2.0
"""The project's pages (.md), and the snippets on them."""
import os
import pathlib
import re

SOURCE = pathlib.Path(os.environ["WARMFRONT_SOURCE"])
BIN = pathlib.Path(os.environ["WARMFRONT_BIN"])
ADDRESS = "127.0.0.1:50051"  # that the snippets name

ROOMS = ("client", "deploy", "engine", "proto", "server", "tests")
PAGES = [SOURCE / "README.md", *sorted(page for room in ROOMS for page in (SOURCE / room).rglob("*.md")
                                       if not any(part.startswith(".") for part in page.relative_to(SOURCE).parts))]
TEXT = {page: page.read_text() for page in PAGES}
# {page: [(language, text)]}
BLOCKS = {page: re.findall(r"^```(\w+)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE) for page, text in TEXT.items()}
