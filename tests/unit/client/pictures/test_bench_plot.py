# SPDX-License-Identifier: Apache-2.0
"""`bench --svg`: bars as long as the times that are reported."""
import json
import xml.etree.ElementTree as xml

import pytest
from conftest import run

STAGES = ("refit", "front", "elementary", "adjacent")
SVG = "{http://www.w3.org/2000/svg}"


def test_bars_are_the_times(tmp_path):
    done = run("bench", "builtin:bart?triangles=1000&frames=6", "--ablations", "front", "--threads-list", "1,2", "--rounds",
               "2", "--svg", tmp_path / "plots", "--json", tmp_path / "bench.json")
    assert done.returncode == 0, done.stderr
    settings = json.loads((tmp_path / "bench.json").read_text())["inputs"][0]["settings"]
    drawing, = (tmp_path / "plots").iterdir()
    assert drawing.name == "bart-triangles-1000-frames-6-bench.svg"
    tree = xml.parse(drawing).getroot()
    texts = [text.text for text in tree.iter(SVG + "text")]
    bars = {stage: [float(box.get("width")) for box in tree.iter(SVG + "rect") if box.get("class") == stage][1:]
            for stage in STAGES}  # the first is the legend's
    assert all(len(widths) == len(settings) >= 4 for widths in bars.values())
    times = {stage: [setting["ms"][stage]["median"] for setting in settings] for stage in STAGES}
    scale = sum(map(sum, bars.values())) / sum(map(sum, times.values()))
    for stage in STAGES:
        assert bars[stage] == pytest.approx([scale * ms for ms in times[stage]], abs=0.3)
    for setting in settings:
        threads = setting["threads"]
        assert f"{setting['setting']}, {threads} thread{'s' if threads > 1 else ''}" in texts
