# SPDX-License-Identifier: Apache-2.0
"""Programs in place of Slurm's, which run the jobs on this machine and at once. They are called a hundred times: they load little."""

# Runs each task of an array, or the job; what it was given is a line of calls.json.
SBATCH = """#!/usr/bin/python3 -SE
import json, os, sys
calls = os.path.join(os.path.dirname(os.path.abspath(__file__)), "calls.json")
at = next(i for i, word in enumerate(sys.argv) if word.endswith(".sbatch"))
options, script = sys.argv[1:at], sys.argv[at:]
said = dict(option.lstrip("-").partition("=")[::2] for option in options)
with open(calls, "a") as log:
    log.write(json.dumps([options, script]) + "\\n")
with open(calls) as log:
    job = str(len(log.readlines()) + 100)
tasks = [None]
if "array" in said:
    if os.environ.get("REFUSE_ARRAYS"):
        sys.exit("sbatch: error: Batch job submission failed: " + os.environ["REFUSE_ARRAYS"])
    tasks = []
    for part in said["array"].split(","):
        first, _, last = part.partition("-")
        tasks += range(int(first), int(last or first) + 1)
if "HOLD" in os.environ:
    tasks = []  # they stay in the queue
for task in tasks:
    environment = {**os.environ, "SLURM_JOB_ID": job, "SLURM_JOB_NUM_NODES": said.get("nodes", "1")}
    if task is not None:
        environment["SLURM_ARRAY_TASK_ID"] = str(task)
    log = said["output"].replace("%a", str(task)).replace("%A", job).replace("%j", job)
    child = os.fork()
    if child == 0:
        with open(log, "a") as out:
            os.dup2(out.fileno(), 1)
            os.dup2(out.fileno(), 2)
        os.chdir(said.get("chdir", "."))
        os.execvpe("bash", ["bash", *script], environment)
    os.waitpid(child, 0)
print(job)
"""

# A task for each node, all on this machine; remembers its processes for scancel.
SRUN = """#!/usr/bin/python3
import os, pathlib, subprocess, sys
here = pathlib.Path(__file__).parent
options = [word for word in sys.argv[1:] if word.startswith("--")][:3]
command = sys.argv[1 + len(options):]
nodes = int(os.environ["SLURM_JOB_NUM_NODES"])
tasks = [subprocess.Popen(command, env={**os.environ, "SLURMD_NODENAME": f"n{node}", "SLURM_NODEID": str(node)},
                          start_new_session=True) for node in range(nodes)]
(here / "step").write_text(" ".join(str(task.pid) for task in tasks))
sys.exit(max(task.wait() for task in tasks))
"""

# The file "queue" has a line for each job that did not end; of others Slurm knows nothing.
SQUEUE = """#!/bin/bash
jobs=''
[ ! -e "${0%/*}/queue" ] || jobs=" $(< "${0%/*}/queue") "
jobs=${jobs//$'\\n'/ }
if [[ $jobs == *" broken "* ]]; then
  echo "slurm_load_jobs error: Unable to contact slurm controller (connect failure)" >&2
  exit 1
fi
while [ "$1" != -j ]; do shift; done
if [[ $jobs != *" $2 "* ]]; then
  echo "slurm_load_jobs error: Invalid job id specified" >&2
  exit 1
fi
echo "it is there"
"""

SCANCEL = """#!/bin/bash
echo "$*" >> "$(dirname "$0")/scancelled"
for group in $(cat "$(dirname "$0")/step"); do kill -TERM -- "-$group"; done
"""

STAND_INS = {"sbatch": SBATCH, "srun": SRUN, "squeue": SQUEUE, "scancel": SCANCEL}
