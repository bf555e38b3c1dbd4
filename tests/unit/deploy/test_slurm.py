# SPDX-License-Identifier: Apache-2.0
"""The scripts of deploy/slurm with stand-ins for sbatch, srun and scancel, which run the jobs here and at once."""
import fcntl
import json
import os
import pathlib
import shutil
import signal
import subprocess
import time

import pytest
from slurm_stand_ins import STAND_INS

SLURM = pathlib.Path(os.environ["WARMFRONT_SOURCE"]) / "deploy/slurm"
BIN = pathlib.Path(os.environ["WARMFRONT_BIN"])
SCENE = "builtin:bart?triangles=1000&frames=13"
OPTIONS = ["--min-separation", "0.03"]


@pytest.fixture
def place(tmp_path):
    for name, text in STAND_INS.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    return tmp_path


def run(place, *command, check=None, **variables):
    environment = {**os.environ, "PATH": f"{place}:{BIN}:{os.environ['PATH']}", **variables}
    done = subprocess.run([str(word) for word in command], cwd=place, env=environment, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=300)
    if check is not None:
        assert done.returncode == check, done.stdout
    return done.stdout


def submit(place, *arguments, check=0, **variables):
    return run(place, SLURM / "submit", *arguments, check=check, **variables)


def calls(place):
    return [json.loads(line) for line in (place / "calls.json").read_text().splitlines()]


def arrays(place):
    return [option.partition("=")[2] for options, _ in calls(place) for option in options if option.startswith("--array=")]


def merge_log(place, folder):
    return sorted((place / folder / "logs").glob("merge-*.log"), key=lambda path: path.stat().st_mtime_ns)[-1].read_text()


def serial(place, *inputs):
    run(place, "warmfront", "detect", *inputs, *OPTIONS, "--json", "serial.json", "--contacts", "serial.csv", check=0)
    report = json.loads((place / "serial.json").read_text())
    assert any(frame["vf"] + frame["ee"] for frame in report["frames"])
    return report["contacts_hash"]


def program_that(place, text):
    """A warmfront that does something else first."""
    path = place / "program"
    path.write_text(f"#!/bin/bash\n{text}\nexec warmfront \"$@\"\n")
    path.chmod(0o755)
    return str(path)


def test_the_array_and_its_merge_give_what_one_run_gives(place):
    expected = serial(place, SCENE)
    said = submit(place, "--folder", "run", "--range=5", "--contacts", "csv", "--slurm=--partition=long", SCENE, "--", *OPTIONS)
    assert "3 of 3 ranges (0-2)" in said
    (array, script), (merge, _) = calls(place)
    assert "--array=0-2" in array and "--partition=long" in array and script[0].endswith("detect-array.sbatch")
    assert "--dependency=afterany:101" in merge and "--partition=long" in merge
    assert json.loads((place / "run/merged.json").read_text())["contacts_hash"] == expected
    assert (place / "run/contacts.csv").read_bytes() == (place / "serial.csv").read_bytes()
    assert f"contacts hash {expected}" in merge_log(place, "run")
    assert [path.name for path in sorted((place / "run/reports").iterdir())] == [
        f"{first:08}-{last:08}.{ending}" for first, last in ((0, 5), (5, 10), (10, 12)) for ending in ("csv", "json")]
    # Once more: nothing to do but to merge.
    assert "all 3 ranges have reports" in submit(place, "--folder", "run")
    assert arrays(place) == ["0-2"]


def test_names_of_any_kind_and_a_part_of_the_frames(place):
    meshes = place / "meshes of 'mine'"
    meshes.mkdir()
    for t in range(6):
        (meshes / f"$t {t}.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv .2 .2 {t % 2 - .5}\nv .3 .2 {t % 2 - .5}\nv .2 .3 {t % 2 - .5}\n"
                                            "f 1 2 3\nf 4 5 6\n")
    inputs = sorted(meshes.iterdir())
    expected = serial(place, *inputs, "--frames", "1:5")
    submit(place, "--folder", "the run", "--range", "2", "--frames", "1:5", "--contacts", "csv", *inputs, "--", *OPTIONS)
    merged = json.loads((place / "the run/merged.json").read_text())
    assert merged["contacts_hash"] == expected
    assert [frame["frame"] for frame in merged["frames"]] == [2, 3, 4, 5]
    assert (place / "the run/contacts.csv").read_bytes() == (place / "serial.csv").read_bytes()


def test_series_of_contacts(place):
    submit(place, "--folder", "run", "--range", "6", "--contacts", "vtp", SCENE, "--", *OPTIONS)
    run(place, "warmfront", "detect", SCENE, *OPTIONS, "--contacts", "serial.vtp", check=0)
    for frame in range(1, 13):
        assert (place / f"run/contacts_{frame:06}.vtp").read_bytes() == (place / f"serial_{frame:06}.vtp").read_bytes()


def test_only_what_is_missing_is_done_again(place):
    expected = serial(place, SCENE)
    failing = program_that(place, f'case ${{SLURM_ARRAY_TASK_ID-}} in [1346]) [ -e {place}/repaired ] || {{ echo no space >&2; exit 2; }};; esac')
    submit(place, "--folder", "run", "--range", "2", SCENE, "--", *OPTIONS, WARMFRONT=failing)
    assert not (place / "run/merged.json").exists()
    said = merge_log(place, "run")
    assert "frames 2:4, 6:10 (6 of 12 missing)" in said
    assert f"submit --folder {place}/run\n" in said
    assert "1,3-4" in submit(place, "--folder", "run", "--dry-run")
    times = {path: path.stat().st_mtime_ns for path in (place / "run/reports").iterdir()}
    (place / "repaired").touch()
    submit(place, "--folder", "run")
    assert arrays(place) == ["0-5", "1,3-4"]
    assert {path: path.stat().st_mtime_ns for path in times} == times
    assert json.loads((place / "run/merged.json").read_text())["contacts_hash"] == expected


def test_all_tasks_fail(place):
    failing = program_that(place, '[ -z "${SLURM_ARRAY_TASK_ID-}" ] || exit 2')
    submit(place, "--folder", "run", "--range", "6", SCENE, WARMFRONT=failing)
    assert "no range has a report" in merge_log(place, "run")


def test_a_task_that_is_killed_leaves_nothing_that_counts(place):
    """Killed with -9 when everything is written but not yet renamed, which is as late as it can be."""
    submit(place, "--folder", "run", "--range", "6", "--contacts", "csv", SCENE, HOLD="1")
    environment = {**os.environ, "PATH": f"{place}:{BIN}:{os.environ['PATH']}", "SLURM_ARRAY_TASK_ID": "0"}
    (place / "sync").write_text(f'#!/bin/bash\n[ -e {place}/second ] && exec /usr/bin/env -i /bin/sync "$@"\ntouch {place}/written\nsleep 1000\n')
    (place / "sync").chmod(0o755)
    task = ["bash", str(SLURM / "detect-array.sbatch"), str(place / "run")]
    killed = subprocess.Popen(task, env=environment, start_new_session=True, stdout=subprocess.DEVNULL)
    while not (place / "written").exists():
        assert killed.poll() is None
        time.sleep(0.02)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    left = [path.name for path in (place / "run/reports").iterdir()]
    assert len(left) == 1 and left[0].startswith(".")
    (place / "second").touch()
    again = subprocess.run(task, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    assert "frames 0:6: done" in again.stdout
    assert sorted(path.name for path in (place / "run/reports").iterdir()) == ["00000000-00000006.csv", "00000000-00000006.json"]
    third = subprocess.run(task, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    assert "there already" in third.stdout


@pytest.mark.parametrize("arguments, code, says", [
    ([], 3, "--folder is needed"),
    (["--folder"], 3, "--folder needs a value"),
    (["--folder", "run"], 3, "an input is needed"),
    (["--folder", "run", "--range", "0", SCENE], 3, "--range 0: a number of frames"),
    (["--folder", "run", "--frames", "3", SCENE], 3, "--frames 3: FIRST:LAST"),
    (["--folder", "run", "--frames", "5:3", SCENE], 3, "FIRST must be below LAST"),
    (["--folder", "run", "--frames", "3:99", SCENE], 3, "LAST at most 12"),
    (["--folder", "run", "--contacts", "txt", SCENE], 3, "csv, jsonl or vtp"),
    (["--folder", "run", "--tier", "exact", SCENE], 3, "there is no option --tier (what is for 'warmfront detect' comes after --)"),
    (["--folder", "run", SCENE, "--", "--json=x"], 3, "--json is given to each task"),
    (["--folder", "run", "nowhere"], 2, "nowhere: no such file or folder"),
    (["--folder", "run", SCENE, "--", "--tier", "sharp"], 2, "'warmfront detect' fails for this input"),
])
def test_what_cannot_be_submitted(place, arguments, code, says):
    assert says in submit(place, *arguments, check=code)
    assert not (place / "calls.json").exists() and not (place / "run/command").exists()


def test_a_folder_has_one_run(place):
    submit(place, "--folder", "run", SCENE)
    assert "already belongs to a run" in submit(place, "--folder", "run", SCENE, check=2)
    assert "already belongs to a run" in submit(place, "--folder", "run", "--", "--tier", "exact", check=2)


def test_two_at_once_do_not_submit_the_same(place):
    (place / "run").mkdir()
    with open(place / "run/lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert "another submit is at work on run: wait" in submit(place, "--folder", "run", SCENE, check=2)
        submit(place, "--folder", "run", "--dry-run", SCENE)
        assert not (place / "calls.json").exists() and not (place / "run/command").exists()
    submit(place, "--folder", "run", SCENE)
    with open(place / "run/lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert "another submit is at work on run: wait" in submit(place, "--folder", "run", check=2)
    submit(place, "--folder", "run")


def test_a_dry_run_leaves_no_folder(place):
    assert "2 of 2 ranges to do: 0-1" in submit(place, "--folder", "run", "--range", "6", "--dry-run", SCENE)
    assert not (place / "run").exists() and not (place / "calls.json").exists()
    submit(place, "--folder", "run", SCENE)


def test_slurm_refuses(place):
    said = submit(place, "--folder", "run", "--slurm=-pgone", SCENE, check=2, REFUSE_ARRAYS="Invalid job array specification")
    assert "Invalid job array specification" in said and "a larger --range makes fewer" in said
    said = submit(place, "--folder", "run", SCENE, check=2, REFUSE_ARRAYS="Invalid account")
    assert "Invalid account" in said and "--range" not in said
    # Nothing was submitted, so the folder is free for what is to be done about it.
    submit(place, "--folder", "run", "--range", "12", SCENE)
    assert arrays(place)[2:] == ["0"] and "-pgone" not in calls(place)[2][0]


def merges(place):
    return [options for options, script in calls(place) if script[0].endswith("merge.sbatch")]


def test_options_of_sbatch_are_kept_and_go_to_the_merge(place):
    given = ["--slurm=--partition=long", "--slurm=-A", "--slurm=me", "--slurm=--cpus-per-task=2", "--slurm=-c", "--slurm=1",
             "--slurm=--time=9", "--slurm=--mem=4G", "--merge-slurm=--time=1"]
    tasks = ["--partition=long", "-A", "me", "--cpus-per-task=2", "-c", "1", "--time=9", "--mem=4G"]
    submit(place, "--folder", "run", *given, SCENE, HOLD="1")
    submit(place, "--folder", "run", HOLD="1")
    submit(place, "--folder", "run", "--slurm=--partition=short", HOLD="1")
    submit(place, "--folder", "run", "--slurm=", "--merge-slurm=", HOLD="1")
    own = [option for option in merges(place)[3] if not option.startswith("--dependency")]
    without = [[option for option in options if option not in own and not option.startswith(("--dependency", "--array", "--output"))]
               for options, _ in calls(place)]
    merge = ["--partition=long", "-A", "me", "--time=9", "--time=1"]
    assert without == [tasks, merge, tasks, merge, ["--partition=short"], ["--partition=short", "--time=1"], [], []]


def test_what_is_in_the_queue_is_not_submitted_again(place):
    submit(place, "--folder", "run", SCENE, HOLD="1")
    for job in ("101", "102"):  # the array, then the merge alone
        (place / "queue").write_text(job)
        assert f"job {job} of the last submission is in the queue" in submit(place, "--folder", "run", check=2)
    (place / "queue").write_text("broken")
    assert "does not tell whether job 101" in submit(place, "--folder", "run", check=2)
    assert len(calls(place)) == 2
    (place / "queue").write_text("99")
    left = place / "run/reports/.00000000-00000012.101-0.abcdef"
    left.mkdir()
    submit(place, "--folder", "run")
    assert (place / "run/merged.json").exists() and not left.exists()


def test_tasks_leave_each_others_work_alone(place):
    """Two of one range, such as one that Slurm takes for dead: each removes only its own."""
    submit(place, "--folder", "run", SCENE, HOLD="1")
    reports = place / "run/reports"
    other, own = (reports / f".00000000-00000012.{job}-0.abcdef" for job in (100, 101))
    other.mkdir()
    own.mkdir()
    run(place, "bash", SLURM / "detect-array.sbatch", place / "run", check=0, SLURM_ARRAY_JOB_ID="101", SLURM_ARRAY_TASK_ID="0")
    assert other.exists() and not own.exists()
    assert (reports / "00000000-00000012.json").exists()


@pytest.mark.parametrize("frames, range_", [(":5", "0:5"), ("5:", "5:12"), (":", "0:12")])
def test_frames_as_detect_takes_them(place, frames, range_):
    submit(place, "--folder", "run", "--frames", frames, SCENE, HOLD="1")
    assert (place / "run/frames").read_text() == range_ + "\n"


def test_the_service(place):
    environment = {**os.environ, "PATH": f"{place}:{BIN}:{os.environ['PATH']}", "SLURM_JOB_ID": "7", "SLURM_JOB_NUM_NODES": "2"}
    job = subprocess.Popen(["bash", str(SLURM / "service.sbatch"), str(place / "s"), "--insecure"], env=environment,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        addresses = [run(place, SLURM / "address", place / "s", "120", check=0, SLURM_PROCID=str(rank)).strip() for rank in range(4)]
        assert addresses[:2] == addresses[2:] and addresses[0] != addresses[1]
        expected = serial(place, SCENE)
        for address in addresses[:2]:
            said = run(place, "warmfront", "detect", SCENE, *OPTIONS, "--server", address.replace(os.uname().nodename, "127.0.0.1"), check=0)
            assert f"contacts hash {expected}" in said
        job.send_signal(signal.SIGTERM)
        said, _ = job.communicate(timeout=120)
    finally:
        job.kill()
    assert job.returncode == 0, said
    assert (place / "scancelled").read_text() == "--signal=TERM 7.0\n"
    assert not (place / "s/addresses").exists() and not list((place / "s/nodes").glob("*.address"))
    for node in ("n0", "n1"):
        assert " info drained calls_cut_off=0 " in (place / f"s/nodes/{node}.log").read_text()


def test_options_of_the_service_override_its_defaults(place):
    environment = {**os.environ, "PATH": f"{place}:{BIN}:{os.environ['PATH']}", "SLURM_JOB_ID": "7", "SLURM_JOB_NUM_NODES": "2",
                   "SLURM_CPUS_PER_TASK": "1", "WARMFRONT_HOST_COMMAND": 'echo "$SLURMD_NODENAME-ib"'}
    job = subprocess.Popen(["bash", str(SLURM / "service.sbatch"), str(place / "s"), "--insecure", "--threads=2", "--log-level", "debug",
                            "--log-format=json"], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        # A rank gets the daemon of its node, by the name that the command gave it.
        for node in ("n1", "n0"):
            address = run(place, SLURM / "address", place / "s", "120", check=0, SLURM_PROCID="0", SLURMD_NODENAME=node)
            assert address.startswith(f"{node}-ib:") and address.strip() in (place / "s/addresses").read_text().split()
        job.send_signal(signal.SIGTERM)
        said, _ = job.communicate(timeout=120)
    finally:
        job.kill()
    assert job.returncode == 0, said
    events = [json.loads(line) for line in (place / "s/nodes/n0.log").read_text().splitlines()]
    assert [event["threads"] for event in events if event["event"] == "serving"] == [2]


def test_a_service_that_cannot_start(place):
    environment = {"SLURM_JOB_ID": "7", "SLURM_JOB_NUM_NODES": "2"}
    said = run(place, "bash", SLURM / "service.sbatch", place / "s", check=3, **environment)  # neither TLS nor --insecure
    assert "--insecure" in said and not (place / "s/addresses").exists()
    said = run(place, "bash", SLURM / "service.sbatch", place / "s", "--insecure", "--log-level=error", check=3, **environment)
    assert "--log-level error: the addresses are read from the logs" in said
    said = run(place, "bash", SLURM / "service.sbatch", place / "s", "--insecure", check=2, WARMFRONT_HOST_COMMAND="true", **environment)
    assert "'true' prints no name of one word on n0" in said
    assert "no daemons serve there" in run(place, SLURM / "address", place / "s", "0", check=2)


def test_shellcheck():
    if not shutil.which("shellcheck"):
        pytest.skip("shellcheck is not installed (Debian: apt-get install shellcheck)")
    scripts = [SLURM / "submit", SLURM / "address", *sorted(SLURM.glob("*.sbatch"))]
    done = subprocess.run(["shellcheck", *scripts], stdout=subprocess.PIPE, text=True)
    assert done.returncode == 0, done.stdout
