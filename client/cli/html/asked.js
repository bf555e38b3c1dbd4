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
  ve: { name: "vertex-edge", mark: "down", between: [0, 1, 2, 3], ends: [2, 3] },
  ev: { name: "edge-vertex", mark: "down", between: [0, 1, 2, 2], ends: [0, 1] },
  fv: { name: "face-vertex", mark: "dot", ...atVertex, between: [3, 3, 3, 3] },
};
const marks = ["dot", "diamond", "triangle", "square", "down"];  // by the number that the shader has

// By the numbers that rows have. Of half-spaces there are pairs where there are any, of points where any are listed.
const pairKinds = ["vf", "ee", "vh", "ve", "vv"], closestKinds = ["vv", "ev", "ee", "fv", "vh"];
const hasHalfSpaces = scene.bodies.some(body => body.half_space);
const shownOf = kinds => kinds.filter((kind, number) =>
  (kind === "vh" ? hasHalfSpaces : !/^v[ev]$/.test(kind) || contactKind.includes(number)));

// How many pairs each step has. What the page is told as edge-edge has in it those that are tested so, of points: where all
// are listed, they are told apart.
const allListed = scene.asked !== "closest" && scene.asked !== "tangled" && scene.steps.every((_, i) => {
  const [first, end] = contactsOf(i + 1);
  return end - first === scene.vf[i] + scene.ee[i] + scene.vh[i];
});
function pairCounts() {
  const none = () => scene.steps.map(() => 0);
  const counts = { vf: scene.vf, ee: [...scene.ee], vh: scene.vh, ve: none(), vv: none() };
  if (!allListed) return counts;
  scene.steps.forEach((_, i) => {
    const [first, end] = contactsOf(i + 1);
    for (let c = first; c < end; ++c) {
      if (contactKind[c] < 3) continue;
      ++counts[pairKinds[contactKind[c]]][i];
      --counts.ee[i];
    }
  });
  return counts;
}

const plural = (count, word) => `${number(count)} ${word}${count === 1 ? "" : "s"}`;
const milliseconds = i => `<br>${number(scene.ms.total[i])} ms`;
const orOfPoints = !allListed && pointsOf(parts[0]).length > 0 ? " or of points" : "";
const pairsOf = (i, counts, shown) =>
  shown.map(kind => `${number(counts[kind][i])} ${kinds[kind].name}${kind === "ee" ? orOfPoints : ""}`).join(", ") +
  (scene.possible[i] ? ` (${number(scene.possible[i])} possible)` : "");
const least = i => `<br>least distance ${scene.least_distance[i] === null ? "&ndash;" : scene.least_distance[i].toPrecision(4)}`;
const short = (x, digits) => String(Number(x.toPrecision(digits)));
const withinDistance = () => `within ${short(scene.distance, 9)}${scene.thick ? " and the thickness of both" : ""}, ${scene.tier}`;
const distanceRamp = () => (scene.thick
  ? { name: "distance, as a share of what counts as near", ends: ["0", "0.5", "1"] }
  : { name: "distance", ends: (scene.distance > 0 ? [0, 0.5, 1] : [0]).map(share => short(share * scene.distance, 4)) });

// By what was asked: `things` and one `thing`; all `kinds`, and those that are `shown`; `how`, of the subtitle; `tip`, of a
// step, after its number.
const asked = {
  steps: () => ({
    thing: "contact", things: "contacts", kinds: pairKinds, counts: pairCounts(), shown: shownOf(pairKinds),
    coloured: "contacts coloured by their time of impact",
    ramp: { name: "time of impact in the step", ends: ["0", "0.5", "1"] },
    stages: ["refit", "front", "elementary", "adjacent"],
    how: `${scene.tier}${scene.tier === "certified" ? " " + scene.tolerance.toExponential() : ""}` +
      (scene.min_separation > 0 ? `, separation ${scene.min_separation}` : "") +
      `, front ${scene.front}, bounds ${scene.bounds}, ${scene.threads} thread${scene.threads === 1 ? "" : "s"}`,
    tip(i) {
      const ms = scene.ms, first = scene.earliest_toi[i];
      return pairsOf(i, this.counts, this.shown) + `<br>first at ${first === null ? "&ndash;" : first.toPrecision(4)}${milliseconds(i)}: refit ` +
        `${number(ms.refit[i])}, front ${number(ms.front[i])}, elementary ${number(ms.elementary[i])}, adjacent ` +
        `${number(ms.adjacent[i])}`;
    },
  }),
  near: () => ({
    thing: "pair", things: "pairs", kinds: pairKinds, counts: pairCounts(), shown: shownOf(pairKinds),
    coloured: "near pairs coloured by their distance", ramp: distanceRamp(), stages: ["total"],
    how: `pairs ${withinDistance()}`,
    tip(i) { return pairsOf(i, this.counts, this.shown) + least(i) + milliseconds(i); },
  }),
  closest: () => ({
    thing: "closest pair", things: "closest pairs", kinds: closestKinds, counts: scene.rows, shown: closestKinds.slice(0, hasHalfSpaces ? 5 : 4),
    coloured: "closest pairs coloured by their distance", ramp: distanceRamp(), stages: ["total"],
    how: `closest pairs ${withinDistance()}`,
    tip(i) {
      const of = pairsOf(i, pairCounts(), hasHalfSpaces ? ["vf", "ee", "vh"] : ["vf", "ee"]);
      return `${plural(totalOf(i), "closest pair")} of ${of}` + least(i) + milliseconds(i);
    },
  }),
  tangled: () => ({
    thing: "pair", things: "pairs", kinds: ["ef"], counts: scene, shown: ["ef"],
    coloured: "marks where edges meet faces", ramp: null, stages: ["total"],
    how: "edges that meet faces",
    tip: i => `${number(scene.ef[i])} edge-face` + milliseconds(i),
  }),
}[scene.asked]();

const kindOf = c => kinds[asked.kinds[contactKind[c]]];
// How many were found in the i-th step, listed or not.
const totalOf = i => asked.kinds.reduce((sum, kind) => sum + asked.counts[kind][i], 0);
