# SPDX-License-Identifier: Apache-2.0
"""Everything that pages refer to exists: links and their headings, files, tests, settings, metrics."""
import re

import pytest
from pages import PAGES, SOURCE, TEXT

BACKTICKS = re.compile(r"`([^`\n]+)`")


def prose(page):
    """The page without its snippets."""
    return re.sub(r"^```.*?^```$", "", TEXT[page], flags=re.DOTALL | re.MULTILINE)


def anchors(page):
    """Of a page's headings, as the usual renderers name them."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        found.add(re.sub(r"[^\w\- ]", "", words).strip().replace(" ", "-"))
    return found


def of_all_sources(*patterns):
    return "\n".join(path.read_text(errors="replace") for pattern in patterns for path in sorted(SOURCE.glob(pattern)))


each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(SOURCE)))


@each_page
def test_links(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        led_to = (page.parent / path).resolve() if path else page
        assert led_to.exists(), f"{target}: there is no {led_to.relative_to(SOURCE)}"
        if anchor:
            assert anchor in anchors(led_to), f"{target}: no such heading; there are {sorted(anchors(led_to))}"


@each_page
def test_files(page):
    for name in BACKTICKS.findall(prose(page)):
        if re.fullmatch(r"(client|deploy|engine|proto|server|tests)/[\w./*-]+", name):
            assert any(SOURCE.glob(name.rstrip("/"))), f"{name} is not there"
        elif re.fullmatch(r"\w+\.(h|cpp|proto|cmake)|_?[a-z]\w*\.py", name):
            assert any(page.parent.rglob(name)) or any((SOURCE / "tests").rglob(name)), f"{name} is not there"


@each_page
def test_tests(page):
    sources = of_all_sources("tests/**/*.cpp")
    targets = of_all_sources("tests/**/CMakeLists.txt")
    for name in BACKTICKS.findall(prose(page)):
        if found := re.fullmatch(r"([A-Z]\w+)\.([A-Z]\w+)", name):
            suite, case = found.groups()
            assert re.search(rf"\b{suite},\s*{case}\b", sources), f"there is no test {name}"
        elif re.fullmatch(r"[a-z_]+_(test|bench)", name):
            assert re.search(rf"\b{name}\b", targets), f"there is no program {name}"
        elif re.fullmatch(r"test_\w+\.py|\w+_test\.cpp|\w+_fuzz\.cpp", name):
            assert any((SOURCE / "tests").rglob(name)), f"there is no {name}"


@each_page
def test_settings_and_metrics(page):
    settings = of_all_sources("server/settings.cpp", "server/config.cpp", "client/cli/**/*.cpp", "client/python/examples/*.py", "deploy/slurm/*")
    metrics = of_all_sources("server/observe/*.cpp", "server/*.cpp")
    for name in BACKTICKS.findall(prose(page)):
        ours = re.match(r"--|warmfrontd? |(detect|merge|queries|accuracy|bench|load|replay|scene|sessions) ", name)
        for flag in re.findall(r"(?:^|\s)--([a-z][a-z-]+)", name) if ours else ():
            assert re.search(rf'"(?:--)?{flag}"|--{flag}\b', settings), f"there is no option --{flag}"
        if re.fullmatch(r"warmfront_[a-z_]+_(total|bytes|seconds)", name):
            assert name in metrics, f"there is no metric {name}"
