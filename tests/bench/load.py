#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Loads a daemon and holds the report against the daemon's own metrics.

tests/bench/load.py BIN_DIR [SESSIONS [SECONDS]] (64 sessions, 60 seconds) starts warmfrontd, streams scenes of 4,000
triangles to it in a closed loop and at rising rates up to the knee and beyond, and prints the tables of
tests/README.md. Exit code 1 where report and metrics differ by more than 5%, or in a count at all.
"""
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

SCENE = "builtin:cloth-ball?triangles=4000"
RATES = "100:1600:x2"
LIMIT = "p99=250ms"
STAGES = ["refit", "front", "elementary", "adjacent"]


class Daemon:
    def __init__(self, binaries, folder):
        self.address = f"unix:{folder}/d.sock"
        log = os.path.join(folder, "log")
        with open(log, "wb") as errors:
            self.process = subprocess.Popen(
                [f"{binaries}/warmfrontd", "--listen", self.address, "--metrics-listen", "127.0.0.1:0", "--log-format", "json"],
                stderr=errors)
        while True:
            if self.process.poll() is not None:
                sys.exit(f"warmfrontd ended: {open(log).read()}")
            found = re.search(r'"metrics_listening".*?"address":"([^"]+)"', open(log).read())
            if found:
                break
            time.sleep(0.05)
        self.metrics_address = found.group(1)

    def metrics(self):
        with urllib.request.urlopen(f"http://{self.metrics_address}/metrics") as answer:
            lines = answer.read().decode().splitlines()
        return {key: float(value) for key, value in (line.rsplit(" ", 1) for line in lines if not line.startswith("#"))}

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait()


def load(binaries, daemon, *arguments):
    command = [f"{binaries}/warmfront", "load", "--server", daemon.address, "--scene", SCENE, "--json", "-", *arguments]
    ran = subprocess.run(command, stdout=subprocess.PIPE)
    if ran.returncode not in (0, 1):
        sys.exit(f"warmfront load failed with {ran.returncode}")
    return json.loads(ran.stdout)


def row(*cells):
    print("| " + " | ".join(cells) + " |")


def latencies(point):
    ms = point["ms"]["latency"]
    return [f"{ms[q]:.1f}" for q in ("p50", "p90", "p99", "p99.9", "max")]


def agreement(point, metrics):
    """The report against the metrics of a daemon that served this load alone."""
    counts, parts = point["counts"], point["ms"]["parts"]
    steps = sum(value for key, value in metrics.items() if key.startswith("warmfront_steps_total"))
    pairs = [("frames", counts["all_frames"], steps, 0),
             ("contacts", counts["all_contacts"], metrics["warmfront_contacts_total"], 0),
             ("sessions", counts["sessions_created"], metrics["warmfront_sessions_created_total"], 0),
             ("queue, mean ms", parts["queue"]["mean"], 1e3 * metrics["warmfront_queue_duration_seconds_sum"] / steps, 0.05)]
    for stage in STAGES:
        sum_of = metrics[f'warmfront_step_duration_seconds_sum{{stage="{stage}"}}']
        pairs.append((f"{stage}, mean ms", parts[stage]["mean"], 1e3 * sum_of / steps, 0.05))
    row(f"{counts['sessions_created']} sessions", "report", "metrics", "apart")
    row(*["---"] * 4)
    good = True
    for name, told, counted, most in pairs:
        apart = abs(told - counted) / max(abs(counted), 1e-12)
        row(name, f"{told:,.4g}" if most else f"{told:,}", f"{counted:,.4g}" if most else f"{counted:,.0f}", f"{100 * apart:.1f}%")
        good &= apart <= most
    return good


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    binaries = sys.argv[1]
    sessions, seconds = (sys.argv[2:] + ["64", "60"][len(sys.argv) - 2:])[:2]
    with tempfile.TemporaryDirectory() as folder:
        daemon = Daemon(binaries, folder)
        report = load(binaries, daemon, "--sessions", sessions, "--duration", f"{seconds}s", "--warmup", "2s")
        point, metrics = report["points"][0], daemon.metrics()
        counts, ms = point["counts"], point["ms"]
        row("sessions", "frames/s", "contacts/s", "MB/s out", "p50 ms", "p90", "p99", "p99.9", "max", "cold p50", "errors")
        row(*["---"] * 11)
        row(sessions, f"{counts['frames_per_second']:.0f}", f"{counts['contacts_per_second']:.0f}",
            f"{1e-6 * counts['sent_bytes'] / point['measured_seconds']:.1f}", *latencies(point),
            f"{ms['cold_first_frame']['p50']:.1f}", str(counts["errors"]))
        whole = ms["latency"]["mean"]
        print("\nmean latency:", ", ".join(f"{name} {100 * part['mean'] / whole:.0f}%" for name, part in ms["parts"].items()), "\n")
        good = agreement(point, metrics)
        swept = load(binaries, daemon, "--sessions", "16", "--duration", "5s", "--rate", RATES, "--limit", LIMIT)
        print()
        row("frames/s due", "sent", "p50 ms", "p90", "p99", "p99.9", "max", "late, mean", "queue, mean", LIMIT)
        row(*["---"] * 10)
        for tried in swept["points"]:
            row(f"{tried['rate']:.0f}", f"{tried['counts']['frames_per_second']:.0f}", *latencies(tried),
                *[f"{tried['ms']['parts'][part]['mean']:.1f}" for part in ("late", "queue")],
                "kept" if tried["limits"][0]["kept"] else "missed")
        daemon.stop()
    sys.exit(0 if good else 1)


main()
