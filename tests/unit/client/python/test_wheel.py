# SPDX-License-Identifier: Apache-2.0
"""The wheels, made of this build: what is in them, and that what is in them runs by itself. `deploy/wheel` builds and installs them as
a user does. $WARMFRONT_BUILD is the build folder, $WARMFRONT_SOURCE the repository."""
import base64
import hashlib
import os
import pathlib
import subprocess
import sys
import zipfile

import pytest

import warmfront

SOURCE = pathlib.Path(os.environ["WARMFRONT_SOURCE"])
sys.path.insert(0, str(SOURCE / "client" / "python"))
import wheel_backend  # noqa: E402

PROGRAM = """
import warmfront
V0 = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [.25, .25, 1], [1.25, .25, 1], [.25, 1.25, 1.]]
V1 = [[x, y, -z] for x, y, z in V0]
with warmfront.open(V0, [[0, 1, 2], [3, 4, 5]], server=SERVER) as session:
    print(warmfront.has_engine(), len(session.step(V1)))
"""


def unpacked(folder, monkeypatch, settings):
    """The wheel, installed where nothing else is; its list of files is right. It is packed as fast as can be, not as small."""
    write = zipfile.ZipFile.writestr
    monkeypatch.setattr(zipfile.ZipFile, "writestr", lambda wheel, entry, content, **level: write(wheel, entry, content, compresslevel=1))
    monkeypatch.setattr(wheel_backend, "_built", lambda: pathlib.Path(os.environ["WARMFRONT_BUILD"]))
    name = wheel_backend.build_wheel(str(folder), settings)
    site = folder / "site"
    with zipfile.ZipFile(folder / name) as wheel:
        for entry in wheel.infolist():
            pathlib.Path(wheel.extract(entry, site)).chmod(entry.external_attr >> 16)
        names = wheel.namelist()
    (record,) = site.glob("*.dist-info/RECORD")
    rows = [line.rsplit(",", 2) for line in record.read_text().splitlines()]
    assert sorted(row[0] for row in rows) == sorted(names)
    for path, digest, size in rows:
        content = (site / path).read_bytes()
        if path != f"{record.parent.name}/RECORD":
            assert digest == "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            assert int(size) == len(content)
    return name, site, names


def run(site, server, **more):
    environment = {name: value for name, value in os.environ.items() if name not in ("WARMFRONTD", "PYTHONPATH")}
    environment.update(PYTHONPATH=str(site), LD_LIBRARY_PATH=str(site / "warmfront" / "lib"), PATH="/usr/bin:/bin", **more)
    return subprocess.run([sys.executable, "-c", PROGRAM.replace("SERVER", repr(server))], env=environment, capture_output=True,
                          text=True, timeout=120)


@pytest.mark.skipif(not warmfront.has_engine(), reason="this package has no engine: built without pybind11-dev, or with sanitizers")
def test_the_whole(tmp_path, monkeypatch):
    name, site, names = unpacked(tmp_path, monkeypatch, None)
    version = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert name.startswith(f"warmfront-0.1.0-{version}-{version}-manylinux_2_") and name.endswith(".whl")
    libraries = {pathlib.Path(each).name for each in names if each.startswith("warmfront/lib/")}
    assert {"libtbb.so.12", "libgmp.so.10"} <= libraries
    assert not any(each.startswith(("libc.", "libm.", "libstdc++.", "libgcc_s.", "ld-linux")) for each in libraries)
    has_baseline = "warmfront/libexec/warmfront/warmfrontd" in names
    assert any(each.startswith("warmfront/_baseline/_engine.") for each in names) == has_baseline
    for server in (None, "local"):  # of which the program is the wheel's own: there is no other
        for more in ({}, {"WARMFRONT_INSTRUCTIONS": "baseline"}):
            done = run(site, server, **more)
            assert (done.returncode, done.stdout) == (0, "True 3\n"), done.stderr
    assert "warmfront = warmfront._programs:warmfront" in next(site.glob("*.dist-info/entry_points.txt")).read_text()
    shown = subprocess.run([sys.executable, "-c", "import sys; sys.argv[1:] = ['--help']; from warmfront._programs import warmfront; warmfront()"],
                           env={"PYTHONPATH": str(site), "LD_LIBRARY_PATH": str(site / "warmfront" / "lib")}, capture_output=True, text=True)
    assert shown.returncode == 0 and "detect" in shown.stdout


def test_the_client_alone(tmp_path, monkeypatch):
    name, site, names = unpacked(tmp_path, monkeypatch, {"client-only": "true"})
    assert name == "warmfront_client-0.1.0-py3-none-any.whl"
    assert "warmfront/py.typed" in names and not any(".so" in each or "/bin/" in each for each in names)
    done = run(site, None)
    assert done.returncode != 0 and "UnimplementedError" in done.stderr and "give a server" in done.stderr
