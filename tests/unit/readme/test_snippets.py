# SPDX-License-Identifier: Apache-2.0
"""The snippets of all pages as a reader uses them: C++ against the installed package, Python against the package built, and
commands in a folder that holds what they name. What takes minutes is only looked up: see ONLY_LOOKED_UP."""
import os
import re
import subprocess
import sys
import types

import pytest
from pages import ADDRESS, BIN, BLOCKS, PAGES, SOURCE

# What a reader has at hand: two triangles, of which the second falls through the first in the first of two frames.
PRELUDE = """
int run(bool of_no_vertices) {
  VertexMatrix<double> V0(6, 3), V1;
  V0 << 0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, 1, 1.25, .25, 1, .25, 1.25, 1;
  V1 = V0;
  V1.bottomRows(3).col(2).setConstant(-1);
  FaceMatrix F(2, 3);
  F << 0, 1, 2, 3, 4, 5;
  const std::vector<VertexMatrix<double>> frames{V1, V1};
  if (of_no_vertices) F.array() += 9;
"""
USE = """
#include <cstdio>
int used = 0;
template <class... Values> void use(const Values&...) { ++used; }
"""

CMAKE = """
cmake_minimum_required(VERSION 3.25)
project(reader LANGUAGES CXX)
set(CMAKE_CXX_FLAGS -O0)
find_package(warmfront REQUIRED)
"""

C_PRELUDE = """
#include <stdint.h>
#include <stdio.h>
static int used = 0;
static void use(int kind, const uint32_t* vertices, double toi, const double* normal) {
  used += kind <= 5 && vertices[0] < 6 && toi <= 1 && normal != NULL;
}
static int fail(const char* text) {
  fprintf(stderr, "%s\\n", text);
  return 1;
}
int main(void) {
  static const double V0[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, 1, 1.25, .25, 1, .25, 1.25, 1};
  static const double V1[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, -1, 1.25, .25, -1, .25, 1.25, -1};
  static const int32_t F[] = {0, 1, 2, 3, 4, 5};
  const uint32_t n = 6;
  const size_t m = 2;
"""

PYTHON_PRELUDE = """
import numpy as np
V0 = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [.25, .25, 1], [1.25, .25, 1], [.25, 1.25, 1]])
V1 = V0 * [1, 1, -1]
F = np.array([[0, 1, 2], [3, 4, 5]])
frames = [V1, V1]
def use(*columns):
    print("used", *map(len, columns))
"""

# Runs each of the programs that its arguments name, and prints how it ended.
PYTHON_FORKS = """
import os, pathlib, runpy, sys
import numpy, warmfront
for program in map(pathlib.Path, sys.argv[1:]):
    child = os.fork()
    if child == 0:
        for number, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(program.with_name(name), os.O_WRONLY | os.O_CREAT), number)
        runpy.run_path(str(program), run_name="__main__")
        sys.exit()
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


def above(snippet):
    """Its includes and using directives, which stay above what is made of it."""
    return [line for line in snippet.splitlines() if line.startswith(("#include", "using "))]


def function(name, snippet, after=""):
    inside = [line for line in snippet.splitlines() if line not in above(snippet)]
    return "\n".join([f"namespace {name} {{", PRELUDE, *inside, after, '  std::printf("used %d\\n", used);', "  return 0;", "}", "}\n"])


def library(lines):
    return "client" if any("client/lib/" in line for line in lines) else "engine"


def chains(snippets):
    """[[names]]: of one library, those with fewer includes first, so that each has what the one before it has, and maybe more."""
    made = []
    for name in sorted(snippets, key=lambda name: len(above(snippets[name][0]))):
        lines = set(above(snippets[name][0]))
        chain = next((chain for chain in made if lines.issuperset(last := above(snippets[chain[-1]][0]))
                      and library(lines) == library(last)), None)
        if chain is None:
            made.append(chain := [])
        chain.append(name)
    return made


def sources(snippets):
    """[(names, text)]: whole programs, of several snippets each, as to read a header takes far longer than to compile a snippet:
    it runs the one that its first argument names. A snippet stands below what it includes itself, and below no other header."""
    for names in chains(snippets):
        text, lines = "", []
        for name in names:
            more = [line for line in above(snippets[name][0]) if line not in lines]
            text += "\n".join([*more, "" if lines else USE, function(name, *snippets[name])])
            lines += more
        calls = "".join(f'  if (!std::strcmp(argv[1], "{name}")) return {name}::run(argc > 2);\n' for name in names)
        yield names, "".join([text, "#include <cstring>\nint main(int argc, char** argv) {\n", calls, "  return 1;\n}\n"])


def whole_programs():
    """{name: snippet} of all rooms' pages: those that begin with their includes."""
    return {"_".join([*page.relative_to(SOURCE).parts[:-1], str(k)]): text for page in PAGES[1:]
            for k, text in enumerate(text for kind, text in BLOCKS[page] if kind == "cpp" and text.startswith("#include"))}


def further_snippets():
    """What pages let a reader do with a session that there is."""
    return [text.replace("= ...;", "= {};") for page in PAGES for kind, text in BLOCKS[page]
            if kind == "cpp" and not text.startswith("#include")]


def front_door():
    """README's snippets: in-process, then remote."""
    in_process, remote = [text for kind, text in BLOCKS[SOURCE / "README.md"] if kind == "cpp"]
    assert "client/lib/client.h" in remote and "client/lib/client.h" not in in_process
    return in_process, remote


@pytest.fixture(scope="module")
def built(tmp_path_factory, address):
    """built(name, *arguments) runs it: a project of a reader's own, of the snippets and nothing else, built with what `cmake --install` installs.
    Nothing that is compiled tells which folder it is in, so that a compiler cache may know it from the last time."""
    folder = tmp_path_factory.mktemp("reader")
    environment = {**os.environ, "CCACHE_BASEDIR": str(folder)}
    subprocess.run(["cmake", "--install", os.environ["WARMFRONT_BUILD"], "--prefix", folder / "installed", "--component",
                    "development"], check=True, stdout=subprocess.DEVNULL)
    in_process, remote = front_door()
    more = further_snippets()
    assert more
    # With a session, which this scene's bodies do not let run: it compiles.
    further = "".join(f"  auto further{k} = [&](auto& session) {{\n{text}  }};\n  (void)further{k};\n"
                      f"  if (frames.empty()) further{k}(session.value());\n" for k, text in enumerate(more))
    snippets = {"in_process": (in_process, ""), "remote": (remote, further), **{name: (text, "") for name, text in whole_programs().items()}}
    lists = CMAKE
    commands = {}
    for names, text in sources(snippets):
        name = names[0]
        commands.update((each, [folder / "build" / name, each]) for each in names)
        (folder / f"{name}.cpp").write_text(text.replace(ADDRESS, "unix:d.sock"))  # of the folder that it runs in
        lists += f"add_executable({name} {name}.cpp)\ntarget_link_libraries({name} warmfront::{library(text.splitlines())})\n"
        if "client/ipc_toolkit/" in text:
            lists += f"target_include_directories({name} PRIVATE {SOURCE}/tests/unit/client/ipc_toolkit/stand_in)\n"
    (folder / "CMakeLists.txt").write_text(lists)
    for command in (["cmake", "-G", "Ninja", "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={folder}/installed"],
                    ["cmake", "--build", folder / "build"]):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
        assert done.returncode == 0, done.stdout
    return lambda name, *more: run([*commands[name], *more], cwd=address.removeprefix("unix:").removesuffix("/d.sock"))


def run(command, **options):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def test_the_engine_in_process(built):
    done = built("in_process")
    # Three contacts in the first frame; in the second nothing moves, and the triangles no longer touch.
    assert (done.returncode, done.stdout) == (0, "used 3\n"), done.stderr


def test_the_client(built):
    done = built("remote")
    assert (done.returncode, done.stdout) == (0, "used 2\n"), done.stderr


def test_a_value_that_is_none_ends_with_the_error(built):
    done = built("in_process", "of no vertices")
    assert done.returncode != 0
    assert "BadResultAccess" in done.stderr and "faces[0][0]: vertex index 9 is not in [0, 6)" in done.stderr


@pytest.mark.parametrize("name", whole_programs())
def test_whole_programs(built, name):
    done = built(name)
    told = re.fullmatch(r"(.+\n)?used (\d+)\n", done.stdout)
    assert done.returncode == 0 and told, done.stdout + done.stderr
    said, used = told.groups()
    # What a program prints is on its page; one that prints nothing uses what it has found.
    assert int(used) > 0 or said, done.stdout
    assert said is None or any(f"prints `{said.strip()}`" in page.read_text() for page in PAGES), said


def test_c(tmp_path):
    """Against what is installed, as a program that knows neither CMake nor C++."""
    subprocess.run(["cmake", "--install", os.environ["WARMFRONT_BUILD"], "--prefix", tmp_path, "--component", "development"], check=True,
                   stdout=subprocess.DEVNULL)
    (library,) = tmp_path.rglob("libwarmfront.so")
    snippets = [text for page in PAGES for kind, text in BLOCKS[page] if kind == "c"]
    assert snippets
    for text in snippets:
        above = [line for line in text.splitlines() if line.startswith("#include")]
        inside = [line for line in text.splitlines() if line not in above]
        (tmp_path / "snippet.c").write_text("\n".join([*above, C_PRELUDE, *inside, 'printf("used %d\\n", used);', "}\n"]))
        done = run(["cc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o", tmp_path / "snippet", tmp_path / "snippet.c",
                    f"-I{tmp_path}/include", f"-L{library.parent}", f"-Wl,-rpath,{library.parent}", "-lwarmfront"])
        assert done.returncode == 0, done.stderr
        done = run([tmp_path / "snippet"])
        assert (done.returncode, done.stdout) == (0, "used 3\n"), done.stderr


def python_snippets():
    return [pytest.param(text, id=f"{page.relative_to(SOURCE)}-{k}") for page in PAGES
            for k, (kind, text) in enumerate(BLOCKS[page]) if kind == "python"]


@pytest.fixture(scope="module")
def interpreted(address, tmp_path_factory):
    """{text: outcome} of Python's snippets: processes of their own, of an interpreter that has loaded what takes long to load."""
    programs = {}
    for text in dict.fromkeys(param.values[0] for param in python_snippets()):
        programs[text] = tmp_path_factory.mktemp("python") / "snippet.py"
        programs[text].write_text(PYTHON_PRELUDE + text.replace(ADDRESS, address))
    done = run([sys.executable, "-c", PYTHON_FORKS, *programs.values()])
    codes = [int(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0 and len(codes) == len(programs), done.stderr
    return {text: types.SimpleNamespace(returncode=code, stdout=program.with_name("stdout").read_text(),
                                        stderr=program.with_name("stderr").read_text())
            for (text, program), code in zip(programs.items(), codes)}


@pytest.mark.parametrize("text", python_snippets())
def test_python(interpreted, text):
    done = interpreted[text]
    assert done.returncode == 0 and "used" in done.stdout, done.stderr


def test_python_of_the_front_door(interpreted):
    text, = (text for kind, text in BLOCKS[SOURCE / "README.md"] if kind == "python")
    done = interpreted[text]
    assert (done.returncode, done.stdout) == (0, "used 3 3 3\nused 0 0 0\n"), done.stderr
