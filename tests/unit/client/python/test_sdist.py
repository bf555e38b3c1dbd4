# SPDX-License-Identifier: Apache-2.0
"""The sdist: a wheel can be built of it and of nothing else. `deploy/wheel` does; here what builds would read is looked for, which
takes seconds. $WARMFRONT_BUILD is the build folder, $WARMFRONT_SOURCE the repository."""
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import tarfile

import pytest

SOURCE = pathlib.Path(os.environ["WARMFRONT_SOURCE"])


def tracked():
    if shutil.which("git") is None or subprocess.run(["git", "-C", SOURCE, "rev-parse"], capture_output=True).returncode != 0:
        pytest.skip("the source is no git repository, or git is not installed")
    listed = subprocess.run(["git", "-C", SOURCE, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout
    return set(listed.rstrip("\0").split("\0"))


def run(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300)
    assert done.returncode == 0, done.stdout[-4000:]
    return done.stdout


def backend_at(root, name):
    """The backend as a front end finds it: by the pyproject.toml at the root."""
    text = (root / "pyproject.toml").read_text()
    (path,) = re.findall(r'^backend-path = \["(.+)"\]$', text, re.MULTILINE)
    (module,) = re.findall(r'^build-backend = "(.+)"$', text, re.MULTILINE)
    spec = importlib.util.spec_from_file_location(name, root / path / f"{module}.py")
    backend = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(backend)
    return backend


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """The archive, and where it is unpacked."""
    tracked()
    folder = tmp_path_factory.mktemp("sdist")
    archive = folder / backend_at(SOURCE / "client" / "python", "of_the_repository").build_sdist(str(folder))
    with tarfile.open(archive) as packed:
        assert all(entry.isfile() and (entry.uid, entry.gid, entry.uname) == (0, 0, "") for entry in packed.getmembers())
        packed.extractall(folder)
    (root,) = (path for path in folder.iterdir() if path.is_dir())
    return archive, root


def test_it_is_what_git_has(sdist):
    archive, root = sdist
    assert (archive.name, root.name) == ("warmfront-0.1.0.tar.gz", "warmfront-0.1.0")
    files = {path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file()}
    assert files - {"PKG-INFO", "pyproject.toml"} == tracked()
    for name in ("CMakeLists.txt", "client/python/wheel_backend.py", "deploy/demo"):
        assert (root / name).read_bytes() == (SOURCE / name).read_bytes()
        assert os.access(root / name, os.X_OK) == os.access(SOURCE / name, os.X_OK)
    about = (root / "PKG-INFO").read_text()
    assert "\nName: warmfront\n" in about and "\nVersion: 0.1.0\n" in about
    assert "\nRequires-Python: >=3.9\n" in about, "which Python a wheel is for is known when it is built"


def test_the_same_files_are_the_same_bytes_also_from_an_sdist(sdist, tmp_path):
    archive, root = sdist
    for made in ("build", "dist"):  # as by deploy/wheel, run there before
        (root / made).mkdir()
        (root / made / "warmfront.whl").write_text("made")
    for k, source in enumerate((SOURCE / "client" / "python", root)):
        out = tmp_path / str(k)
        out.mkdir()
        again = out / backend_at(source, f"again_{k}").build_sdist(str(out))
        assert again.read_bytes() == archive.read_bytes()
    for made in ("build", "dist"):
        shutil.rmtree(root / made)


def test_it_holds_all_that_its_wheels_are_built_of(sdist, tmp_path, monkeypatch):
    """As the backend configures; then ninja says what it would read."""
    _, root = sdist
    backend = backend_at(root, "of_the_sdist")
    commands = []
    backend._run = lambda *command: commands.append([str(part) for part in command])
    monkeypatch.setenv("WARMFRONT_WHEEL_BUILD", str(tmp_path))
    backend._built()
    configure, build = commands
    assert configure[configure.index("-S") + 1] == str(root)
    run(configure)
    read = run(["ninja", "-C", tmp_path, "-t", "inputs", *build[build.index("-t") + 1:]]).splitlines()
    sources = [path for path in read if path.startswith(f"{root}/")]
    assert len([path for path in sources if path.endswith((".cpp", ".proto", ".py"))]) > 150
    assert [path for path in sources if not pathlib.Path(path).exists()] == []
    assert [path for path in read if path.startswith(f"{SOURCE}/")] == [], "something is read from the repository"
