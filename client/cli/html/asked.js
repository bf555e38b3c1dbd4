// SPDX-License-Identifier: Apache-2.0
// What was asked, in words and marks: of the steps from frame to frame, or of each frame as it stands.

// Of a kind: its mark, which lies in the middle between the closest points of two segments, each by two corners of the
// row; and the corners of the edges that are drawn, in pairs.
const atVertex = { between: [0, 0, 0, 0], ends: [] };
const kinds = {
  vf: { name: "vertex-face", mark: "dot", ...atVertex },
  ee: { name: "edge-edge", mark: "diamond", between: [0, 1, 2, 3], ends: [0, 1, 2, 3] },
  ef: { name: "edge-face", mark: "triangle", between: [0, 1, 0, 1], ends: [0, 1] },
  vh: { name: "vertex-half-space", mark: "triangle", ...atVertex },
  vv: { name: "vertex-vertex", mark: "square", between: [0, 0, 1, 1], ends: [] },
  ev: { name: "edge-vertex", mark: "triangle", between: [0, 1, 2, 2], ends: [0, 1] },
  fv: { name: "face-vertex", mark: "dot", ...atVertex, between: [3, 3, 3, 3] },
};
const marks = ["dot", "diamond", "triangle", "square"];  // by the number that the shader has

// Half-spaces are named where there are any.
const pairKinds = scene.bodies.some(body => body.half_space) ? ["vf", "ee", "vh"] : ["vf", "ee"];

const plural = (count, word) => `${number(count)} ${word}${count === 1 ? "" : "s"}`;
const milliseconds = i => `<br>${number(scene.ms.total[i])} ms`;
const pairsOf = i => `${number(scene.vf[i])} vertex-face, ${number(scene.ee[i])} edge-edge` +
                     (scene.vh[i] ? `, ${number(scene.vh[i])} vertex-half-space` : "") +
                     (scene.possible[i] ? ` (${number(scene.possible[i])} possible)` : "");
const least = i => `<br>least distance ${scene.least_distance[i] === null ? "&ndash;" : scene.least_distance[i].toPrecision(4)}`;
const short = (x, digits) => String(Number(x.toPrecision(digits)));
const withinDistance = () => `within ${short(scene.distance, 9)}${scene.thick ? " and the thickness of both" : ""}, ${scene.tier}`;
const distanceRamp = () => (scene.thick
  ? { name: "distance, as a share of what counts as near", ends: ["0", "0.5", "1"] }
  : { name: "distance", ends: (scene.distance > 0 ? [0, 0.5, 1] : [0]).map(share => short(share * scene.distance, 4)) });

// By what was asked: `things` and one `thing`; `how`, of the subtitle; `tip`, of a step, after its number.
const asked = {
  steps: () => ({
    thing: "contact", things: "contacts", kinds: pairKinds, counts: scene,
    coloured: "contacts coloured by their time of impact",
    ramp: { name: "time of impact in the step", ends: ["0", "0.5", "1"] },
    stages: ["refit", "front", "elementary", "adjacent"],
    how: `${scene.tier}${scene.tier === "certified" ? " " + scene.tolerance.toExponential() : ""}` +
      (scene.min_separation > 0 ? `, separation ${scene.min_separation}` : "") +
      `, front ${scene.front}, bounds ${scene.bounds}, ${scene.threads} thread${scene.threads === 1 ? "" : "s"}`,
    tip(i) {
      const ms = scene.ms, first = scene.earliest_toi[i];
      return pairsOf(i) + `<br>first at ${first === null ? "&ndash;" : first.toPrecision(4)}${milliseconds(i)}: refit ` +
        `${number(ms.refit[i])}, front ${number(ms.front[i])}, elementary ${number(ms.elementary[i])}, adjacent ` +
        `${number(ms.adjacent[i])}`;
    },
  }),
  near: () => ({
    thing: "pair", things: "pairs", kinds: pairKinds, counts: scene,
    coloured: "near pairs coloured by their distance", ramp: distanceRamp(), stages: ["total"],
    how: `pairs ${withinDistance()}`,
    tip: i => pairsOf(i) + least(i) + milliseconds(i),
  }),
  closest: () => ({
    thing: "closest pair", things: "closest pairs", kinds: ["vv", "ev", "ee", "fv"], counts: scene.rows,
    coloured: "closest pairs coloured by their distance", ramp: distanceRamp(), stages: ["total"],
    how: `closest pairs ${withinDistance()}`,
    tip: i => `${plural(totalOf(i), "closest pair")} of ${pairsOf(i)}` + least(i) + milliseconds(i),
  }),
  tangled: () => ({
    thing: "pair", things: "pairs", kinds: ["ef"], counts: scene,
    coloured: "marks where edges meet faces", ramp: null, stages: ["total"],
    how: "edges that meet faces",
    tip: i => `${number(scene.ef[i])} edge-face` + milliseconds(i),
  }),
}[scene.asked]();

const kindOf = c => kinds[asked.kinds[contactKind[c]]];
// How many were found in the i-th step, listed or not.
const totalOf = i => asked.kinds.reduce((sum, kind) => sum + asked.counts[kind][i], 0);
