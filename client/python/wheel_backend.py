# SPDX-License-Identifier: Apache-2.0
"""Builds the wheels (PEP 517), with CMake and nothing else: `python3 -m build --no-isolation client/python`.

`warmfront` has the package with the engine, the programs warmfront and warmfrontd, and the libraries that these need beside glibc
and libstdc++. With `--config-setting=client-only=true`, `warmfront-client` has the package alone, which connects to daemons: for
any system.

The build folder is build/wheel, or $WARMFRONT_WHEEL_BUILD. The sdist is the repository as git has it, for any version of Python:
what is not committed but tracked is in it, what is not tracked is not.
"""
from __future__ import annotations

import base64
import gzip
import hashlib
import io
import os
import pathlib
import re
import shutil
import stat
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
REQUIRES = ("numpy (>=1.21)", "grpcio (>=1.51)", "protobuf (>=4.21,<7)")
PROGRAMS = ("warmfront", "warmfrontd")
MADE = ("build", "dist", "out")  # folders at the top that commands make: deploy/wheel puts wheels into dist
# Of glibc, and of the compiler that the system has: a process has one of each.
OF_SYSTEM = re.compile(r"(ld-linux.*|linux-vdso|libc|libm|libdl|librt|libpthread|libresolv|libutil|libstdc\+\+|libgcc_s)\.so")


def _version() -> str:
    return re.search(r"project\(warmfront VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def _run(*command) -> str:
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}:\n{done.stdout}")
    return done.stdout


def _built() -> pathlib.Path:
    """The build folder, up to date. What is in it finds its libraries beside itself; with an RPATH, and not a RUNPATH, so do these."""
    build = pathlib.Path(os.environ.get("WARMFRONT_WHEEL_BUILD", ROOT / "build" / "wheel"))
    link = "-Wl,--disable-new-dtags"
    _run("cmake", "-G", "Ninja", "-S", ROOT, "-B", build, "-DCMAKE_BUILD_TYPE=Release", "-DWARMFRONT_TESTS=OFF",
         "-DCMAKE_INSTALL_RPATH=$ORIGIN/lib:$ORIGIN/../lib:$ORIGIN/../../lib", f"-DCMAKE_EXE_LINKER_FLAGS={link}",
         f"-DCMAKE_MODULE_LINKER_FLAGS={link}", f"-DCMAKE_SHARED_LINKER_FLAGS={link}")
    jobs = os.environ.get("WARMFRONT_WHEEL_JOBS", str(os.cpu_count()))
    _run("cmake", "--build", build, "-j", jobs, "-t", "warmfront_python", *PROGRAMS)
    return build


def _libraries(files) -> dict[str, pathlib.Path]:
    """{name: path} of the shared libraries that these need, and these in turn, but those of the system."""
    found = {}
    for file in files:
        for name, path in re.findall(r"^\s*(\S+) => (.*?)(?: \(0x[0-9a-f]+\))?$", _run("ldd", file), re.MULTILINE):
            if OF_SYSTEM.match(name):
                continue
            if not path.startswith("/"):
                raise RuntimeError(f"{file} needs {name}, which is not found")
            found[name] = pathlib.Path(path).resolve()
    return found


def _stage(folder: pathlib.Path, client_only: bool) -> None:
    """Puts the package into folder/warmfront."""
    build = _built()
    installed = folder / "installed"
    for component in ("python",) if client_only else ("python", "service"):
        _run("cmake", "--install", build, "--prefix", installed, "--component", component, "--strip")
    package = folder / "warmfront"
    shutil.move(installed / "lib" / "python3" / "dist-packages" / "warmfront", package)
    if client_only:
        for engine in package.glob("**/_engine.*.so"):
            engine.unlink()
        shutil.rmtree(package / "_baseline", ignore_errors=True)
    else:
        engines = list(package.glob("**/_engine.*.so"))
        if not engines:
            raise RuntimeError("there is no engine in the package; install pybind11-dev")
        (package / "bin").mkdir()
        for program in PROGRAMS:
            shutil.move(installed / "bin" / program, package / "bin" / program)
        baseline = installed / "libexec"  # for machines without AVX2; both programs look there
        if baseline.is_dir():
            shutil.move(baseline, package / "libexec")
        (package / "lib").mkdir()
        for name, path in sorted(_libraries([*engines, *(package / "bin").iterdir()]).items()):
            shutil.copyfile(path, package / "lib" / name)
    shutil.rmtree(installed)


def _platform() -> str:
    """Of wheels: this processor, and this glibc or a newer one."""
    machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    name, _, version = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" ")
    if name != "glibc" or not machine.startswith("linux_"):
        return machine
    return f"manylinux_{version.replace('.', '_')}_{machine.removeprefix('linux_')}"


def _metadata(name: str, client_only: bool, python: str) -> str:
    what = "the client of its daemons" if client_only else "in this process and as a service"
    return "\n".join(["Metadata-Version: 2.1", f"Name: {name}", f"Version: {_version()}",
                      f"Summary: Warmfront: incremental continuous collision detection, {what}", "License: Apache-2.0",
                      f"Requires-Python: {python}", *(f"Requires-Dist: {each}" for each in REQUIRES),
                      "Description-Content-Type: text/markdown", "", (HERE / "README.md").read_text()])


def _is_client_only(settings) -> bool:
    return str((settings or {}).get("client-only", "")).lower() in ("true", "yes", "1")


def get_requires_for_build_wheel(config_settings=None) -> list[str]:
    return []


def get_requires_for_build_sdist(config_settings=None) -> list[str]:
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None) -> str:
    client_only = _is_client_only(config_settings)
    name = "warmfront-client" if client_only else "warmfront"
    here = f"cp{sys.version_info.major}{sys.version_info.minor}"
    tag = "py3-none-any" if client_only else f"{here}-{here}-{_platform()}"
    base = f"{name.replace('-', '_')}-{_version()}"
    info = f"{base}.dist-info"
    with tempfile.TemporaryDirectory() as folder:
        stage = pathlib.Path(folder)
        _stage(stage, client_only)
        (stage / info).mkdir()
        python = ">=3.9" if client_only else f"=={sys.version_info.major}.{sys.version_info.minor}.*"
        (stage / info / "METADATA").write_text(_metadata(name, client_only, python))
        (stage / info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: warmfront\nRoot-Is-Purelib: {str(client_only).lower()}\n"
                                            f"Tag: {tag}\n")
        shutil.copyfile(ROOT / "LICENSE", stage / info / "LICENSE")
        if not client_only:
            scripts = "".join(f"{program} = warmfront._programs:{program}\n" for program in PROGRAMS)
            (stage / info / "entry_points.txt").write_text("[console_scripts]\n" + scripts)
        wheel = pathlib.Path(wheel_directory) / f"{base}-{tag}.whl"
        _pack(stage, info, wheel)
    return wheel.name


def _pack(stage: pathlib.Path, info: str, wheel: pathlib.Path) -> None:
    record = []
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        def add(name, content, mode):
            entry = zipfile.ZipInfo(name, (2000, 1, 1, 0, 0, 0))  # the same bytes of the same files
            entry.external_attr = (stat.S_IFREG | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content, compresslevel=9)  # the archive's own would not be asked

        for path in sorted(path for path in stage.rglob("*") if path.is_file()):
            name, content = path.relative_to(stage).as_posix(), path.read_bytes()
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(content)}\n")
            add(name, content, 0o755 if "/bin/" in name or ".so" in path.name else 0o644)
        add(f"{info}/RECORD", "".join(record) + f"{info}/RECORD,,\n", 0o644)


def _sources() -> list[str]:
    """Of the repository what git has; of an unpacked sdist, which git does not have, all but what is built."""
    if (ROOT / "PKG-INFO").exists():
        paths = (path.relative_to(ROOT) for path in ROOT.rglob("*") if not path.is_dir())
        names = [path.as_posix() for path in paths if path.parts[0] not in MADE and "__pycache__" not in path.parts]
        return sorted(set(names) - {"PKG-INFO", "pyproject.toml"})
    return sorted(_run("git", "-C", ROOT, "ls-files", "-z").rstrip("\0").split("\0"))


def build_sdist(sdist_directory, config_settings=None) -> str:
    base = f"warmfront-{_version()}"
    path = pathlib.Path(sdist_directory) / f"{base}.tar.gz"
    # Of an sdist these two are at the top.
    project = (HERE / "pyproject.toml").read_text().replace('backend-path = ["."]', 'backend-path = ["client/python"]')
    top = {"PKG-INFO": _metadata("warmfront", client_only=False, python=">=3.9"), "pyproject.toml": project}
    with open(path, "wb") as file, gzip.GzipFile("", "wb", mtime=0, fileobj=file) as packed, \
         tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive:
        def add(name, content, executable=False):
            entry = tarfile.TarInfo(f"{base}/{name}")  # the same bytes of the same files
            entry.size, entry.mtime, entry.mode = len(content), 946684800, 0o755 if executable else 0o644
            archive.addfile(entry, io.BytesIO(content))

        for name in _sources():
            add(name, (ROOT / name).read_bytes(), os.access(ROOT / name, os.X_OK))
        for name, text in top.items():
            add(name, text.encode())
    return path.name
