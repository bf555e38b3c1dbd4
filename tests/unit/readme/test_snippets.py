# SPDX-License-Identifier: Apache-2.0
"""The README's snippets as a reader uses them: C++ against the installed package, Python against the package built."""
import os
import pathlib
import re
import subprocess
import sys

import pytest

SOURCE = pathlib.Path(os.environ["WARMFRONT_SOURCE"])
BIN = pathlib.Path(os.environ["WARMFRONT_BIN"])
ADDRESS = "127.0.0.1:50051"  # that the snippets name

BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", (SOURCE / "README.md").read_text(), re.DOTALL | re.MULTILINE)

# What a reader has at hand: two triangles, of which the second falls through the first in the first of two frames.
PRELUDE = """
#include <cstdio>
int used = 0;
template <class... Values> void use(const Values&...) { ++used; }
int main() {
  VertexMatrix<double> V0(6, 3), V1;
  V0 << 0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, 1, 1.25, .25, 1, .25, 1.25, 1;
  V1 = V0;
  V1.bottomRows(3).col(2).setConstant(-1);
  FaceMatrix F(2, 3);
  F << 0, 1, 2, 3, 4, 5;
  const std::vector<VertexMatrix<double>> frames{V1, V1};
"""

CMAKE = """
cmake_minimum_required(VERSION 3.25)
project(reader LANGUAGES CXX)
set(CMAKE_BUILD_TYPE Debug)
find_package(warmfront REQUIRED)
add_executable(in_process in_process.cpp)
target_link_libraries(in_process warmfront::engine)
add_executable(remote remote.cpp)
target_link_libraries(remote warmfront::client)
add_executable(unchecked unchecked.cpp)
target_link_libraries(unchecked warmfront::engine)
"""


def program(snippet, after=""):
    """A whole program of a snippet: its includes and using directives stay above main()."""
    above = [line for line in snippet.splitlines() if line.startswith(("#include", "using "))]
    inside = [line for line in snippet.splitlines() if line not in above]
    return "\n".join([*above, PRELUDE, *inside, after, '  std::printf("used %d\\n", used);', "}\n"])


def cpp_snippets():
    """Those that are whole, in-process first, and what the README lets them do further with a session."""
    whole = [text for kind, text in BLOCKS if kind == "cpp" and text.startswith("#include")]
    more = [text.replace("= ...;", "= {};") for kind, text in BLOCKS if kind == "cpp" and not text.startswith("#include")]
    return whole, more


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("daemon")
    daemon = subprocess.Popen([BIN / "warmfrontd", "--listen", f"unix:{folder}/d.sock"], stderr=subprocess.DEVNULL)
    yield f"unix:{folder}/d.sock"
    daemon.terminate()
    assert daemon.wait(60) == 0


@pytest.fixture(scope="module")
def built(tmp_path_factory, address):
    """A project of a reader's own, of the snippets and nothing else, built with what `cmake --install` installs."""
    folder = tmp_path_factory.mktemp("reader")
    subprocess.run(["cmake", "--install", os.environ["WARMFRONT_BUILD"], "--prefix", folder / "installed", "--component",
                    "development"], check=True, stdout=subprocess.DEVNULL)
    whole, more = cpp_snippets()
    assert len(whole) == 2 and len(more) >= 1
    (folder / "in_process.cpp").write_text(program(whole[0]))
    # With the sentence's session, which this scene's bodies do not let run: it compiles.
    further = "".join(f"  auto further{k} = [&](auto& session) {{\n{text}  }};\n  (void)further{k};\n"
                      f"  if (frames.empty()) further{k}(session.value());\n" for k, text in enumerate(more))
    (folder / "remote.cpp").write_text(program(whole[1].replace(ADDRESS, address), further))
    (folder / "unchecked.cpp").write_text(program(whole[0].replace("describe(V0, F)", "describe(V0, FaceMatrix(F.array() + 9))")))
    (folder / "CMakeLists.txt").write_text(CMAKE)
    for command in (["cmake", "-G", "Ninja", "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={folder}/installed"],
                    ["cmake", "--build", folder / "build"]):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == 0, done.stdout
    return folder / "build"


def run(command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_the_engine_in_process(built):
    done = run([built / "in_process"])
    # Three contacts in the first frame; in the second nothing moves, and the triangles no longer touch.
    assert (done.returncode, done.stdout) == (0, "used 3\n"), done.stderr


def test_the_client(built):
    done = run([built / "remote"])
    assert (done.returncode, done.stdout) == (0, "used 2\n"), done.stderr


def test_a_value_that_is_none_ends_with_the_error(built):
    done = run([built / "unchecked"])
    assert done.returncode != 0
    assert "BadResultAccess" in done.stderr and "faces[0][0]: vertex index 9 is not in [0, 6)" in done.stderr


def test_python(address, tmp_path):
    text, = (text for kind, text in BLOCKS if kind == "python")
    (tmp_path / "snippet.py").write_text(f"""
import numpy as np
V0 = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [.25, .25, 1], [1.25, .25, 1], [.25, 1.25, 1]])
V1 = V0 * [1, 1, -1]
F = np.array([[0, 1, 2], [3, 4, 5]])
frames = [V1, V1]
def use(*columns):
    print("used", *map(len, columns))
{text.replace(ADDRESS, address)}
""")
    done = run([sys.executable, tmp_path / "snippet.py"])
    assert (done.returncode, done.stdout) == (0, "used 3 3 3\nused 0 0 0\n"), done.stderr


def test_no_two_snippets_start_daemons_on_one_port():
    ports = []
    for kind, text in BLOCKS:
        for line in text.splitlines() if kind == "sh" else ():
            command = line.split("#")[0]
            for started in re.findall(r"(?:^|[;&|] *)warmfrontd\b([^;&|]*)", command):
                listened = re.findall(r"--listen (\S+)", started) or [ADDRESS]
                ports += [address.rpartition(":")[2] for address in listened]
    assert len(ports) >= 2 and len(set(ports)) == len(ports), ports
