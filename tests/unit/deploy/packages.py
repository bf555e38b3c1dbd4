# SPDX-License-Identifier: Apache-2.0
"""What the packages' recipes are tried with: a build of the engine as they ask for, and a consumer of what they install."""
import functools
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

SOURCE = pathlib.Path(os.environ["WARMFRONT_SOURCE"])
BUILD = pathlib.Path(os.environ["WARMFRONT_BUILD"])
CONSUMER = SOURCE / "deploy" / "conan" / "test_package"


def run(*command, **options):
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=300, **options)
    assert done.returncode == 0, f"{command}:\n{done.stdout[-6000:]}"
    return done.stdout


@functools.cache
def compiler():
    """A folder with what CMake found out about the system and the compiler, which takes most of the time to configure."""
    folder = tempfile.TemporaryDirectory()
    (pathlib.Path(folder.name) / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(any LANGUAGES CXX)\n"
                                                              "find_package(Threads REQUIRED)\n")
    run("cmake", "-S", folder.name, "-B", f"{folder.name}/build")
    return folder  # which is there as long as this is


def know_compiler(build):
    """In a folder where nothing is configured yet the compiler is known from here on, and what is of one project is not."""
    known = pathlib.Path(compiler().name) / "build"
    for found in known.glob("CMakeFiles/*/CMakeSystem.cmake"):
        shutil.copytree(found.parent, build / "CMakeFiles" / found.parent.name)
    of_all = r"^CMAKE_(?!HOME_DIRECTORY|CACHEFILE_DIR|GENERATOR|MAKE_PROGRAM)[\w-]+:(?:FILEPATH|INTERNAL)=.*$"
    (build / "CMakeCache.txt").write_text("\n".join(re.findall(of_all, (known / "CMakeCache.txt").read_text(), re.MULTILINE)) + "\n")


def configure(source, build, *options):
    """As a recipe does; then the engine's library is that of the build at hand, which takes minutes to make."""
    know_compiler(build)
    run("cmake", "-G", "Ninja", "-S", source, "-B", build, "-DCMAKE_BUILD_TYPE=Release", *options)
    shutil.copyfile(BUILD / "engine" / "libwarmfront_engine.a", build / "engine" / "libwarmfront_engine.a")


def install(build, prefix):
    run("cmake", "--install", build, "--prefix", prefix)


def consume(prefix, folder):
    """Builds a program with what was installed, in a project of its own, and runs it. As long as what is compiled is the same, and
    the way from the one folder to the other, a compiler cache may know it."""
    know_compiler(folder)
    run("cmake", "-G", "Ninja", "-S", CONSUMER, "-B", folder, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Release")
    found = re.search(r"^warmfront_DIR:PATH=(.*)$", (folder / "CMakeCache.txt").read_text(), re.MULTILINE).group(1)
    assert pathlib.Path(found).is_relative_to(prefix), f"found another: {found}"
    run("cmake", "--build", folder, env={**os.environ, "CCACHE_BASEDIR": str(folder.parent)})
    assert run(folder / "consumer") == "3 contacts\n"


def found(prefix, folder, component, *options):
    """What find_package(warmfront) says of a component."""
    (folder / "asks").mkdir(exist_ok=True)
    (folder / "asks" / "CMakeLists.txt").write_text(f"""
cmake_minimum_required(VERSION 3.25)
project(asks LANGUAGES CXX)
find_package(warmfront QUIET COMPONENTS {component})
if(warmfront_FOUND)
  file(WRITE ${{CMAKE_BINARY_DIR}}/said "found\n")
else()
  file(WRITE ${{CMAKE_BINARY_DIR}}/said "not found: ${{warmfront_NOT_FOUND_MESSAGE}}\n")
endif()
""")
    shutil.rmtree(folder / "asked", ignore_errors=True)
    know_compiler(folder / "asked")
    run("cmake", "-S", folder / "asks", "-B", folder / "asked", f"-DCMAKE_PREFIX_PATH={prefix}", *options)
    return (folder / "asked" / "said").read_text()


def linked(prefix, folder, components, target):
    """What CMake says to a project that asks for these components and links this target."""
    (folder / "links").mkdir(exist_ok=True)
    (folder / "links" / "main.cpp").write_text("int main() {}\n")
    (folder / "links" / "CMakeLists.txt").write_text(f"""
cmake_minimum_required(VERSION 3.25)
project(links LANGUAGES CXX)
find_package(warmfront REQUIRED COMPONENTS {components})
add_executable(program main.cpp)
target_link_libraries(program {target})
""")
    shutil.rmtree(folder / "linked", ignore_errors=True)
    know_compiler(folder / "linked")
    done = subprocess.run(["cmake", "-S", folder / "links", "-B", folder / "linked", f"-DCMAKE_PREFIX_PATH={prefix}"],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return " ".join(done.stdout.split())


def needed_by_engine():
    """The names of find_package() that CMakeLists.txt asks for without the service."""
    text = (SOURCE / "CMakeLists.txt").read_text()
    names = re.findall(r"find_package\((\w+)", text[:text.index("if(WARMFRONT_SERVICE)")])
    return set(names) - {"Threads"}


def version():
    return re.search(r"project\(warmfront VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
