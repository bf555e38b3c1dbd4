// SPDX-License-Identifier: Apache-2.0
// What the page carries: see client/cli/html/html_page.h for its layout.
const scene = JSON.parse(document.getElementById("scene").textContent);

function bytesOf(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}

const faces = new Uint32Array(bytesOf("faces"));          // (m, 3)
const loneEdges = new Uint32Array(bytesOf("lone-edges")); // (k, 2)
const positions = new Uint16Array(bytesOf("positions"));  // (frames, n, 3), in quanta from the origin; of each part
const corners = scene.asked === "tangled" ? 5 : 4;
const contactV = new Uint32Array(bytesOf("contact-v"));   // (k, corners)
const contactKind = new Uint8Array(bytesOf("contact-kind"));  // of asked.kinds
// What colours each, in [0, 1]: time of impact, or share of the distance.
const values = { steps: "contact-toi", near: "contact-share", closest: "contact-share" }[scene.asked];
const contactValue = values ? new Float32Array(bytesOf(values)) : new Float32Array(contactKind.length);

// However far away and however small the scene is: drawn, its motion's extent is around 0, and 1 at most.
const extent = scene.quantum.map(q => 65535 * q);
const largest = Math.max(...extent);
extent.forEach((e, axis) => { extent[axis] = largest > 0 ? e / largest : 0; });
const quantum = extent.map(e => e / 65535), origin = extent.map(e => -e / 2);

// The motion's parts, each with a topology of its own: mostly one. Of each: the steps before it, and where its faces, lone
// edges and positions begin in the arrays. Its first frame shows the same moment as the last one before it.
const parts = scene.parts || [{ ...scene, first_step: 0 }];
parts.forEach((part, p) => {
  const before = parts[p - 1];
  const end = p + 1 < parts.length ? parts[p + 1].first_step : scene.steps.length;
  part.frames = end - part.first_step + (scene.asked === "steps" ? 1 : 0);
  part.faces = before ? before.faces + 3 * before.triangles : 0;
  part.loneEdges = before ? before.loneEdges + 2 * before.edges : 0;
  part.positions = before ? before.positions + 3 * before.frames * before.vertices : 0;
});
const partOf = k => {
  let p = parts.length - 1;
  while (p > 0 && parts[p].first_step >= k) --p;
  return parts[p];
};
const facesOf = part => faces.subarray(part.faces, part.faces + 3 * part.triangles);
const loneEdgesOf = part => loneEdges.subarray(part.loneEdges, part.loneEdges + 2 * part.edges);
// 1 for each vertex of a face.
function facedVertices(part) {
  const faced = new Uint8Array(part.vertices);
  for (const v of facesOf(part)) faced[v] = 1;
  return faced;
}
const isFaced = ({ first_vertex, vertex_count }, faced) => faced.subarray(first_vertex, first_vertex + vertex_count).includes(1);
// The vertices in no face and no edge.
function pointsOf(part) {
  const used = facedVertices(part);
  for (const v of loneEdgesOf(part)) used[v] = 1;
  return Uint32Array.from(used.keys()).filter(v => used[v] === 0);
}

const stepCount = scene.steps.length;

// Time t counts frames from the first. Steps: step k (from 1) is under way in (k - 1, k]. States: step k is frame k - 1 as it
// stands, and is shown in [k - 1, k).
const states = scene.asked !== "steps";
const lastTime = states ? stepCount - 1 : stepCount;
const firstFrame = scene.steps[0] - (states ? 0 : 1);
const wholeIfState = t => (states ? Math.floor(t) : t);
const stepAt = t => Math.min(stepCount, Math.max(1, states ? Math.floor(t) + 1 : Math.ceil(t)));
const shareAt = t => (states ? 0 : t - (stepAt(t) - 1));
const timeOf = k => (states ? k - 1 : k);
// Is anything found at time t? Not before the first step.
const isAsked = t => states || t > 0;
// Where in `positions` the frames begin that step k is between.
const framesOf = k => {
  const part = partOf(k), local = k - part.first_step;
  return [local - 1, states ? local - 1 : local].map(frame => part.positions + 3 * frame * part.vertices);
};

// What was found in step k is rows [first, end).
function contactsOf(k) {
  return [k > 1 ? scene.contact_ends[k - 2] : 0, scene.contact_ends[k - 1]];
}

function bodyOfVertex(v, bodies) {
  let low = 0, high = bodies.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (bodies[middle].first_vertex <= v) low = middle; else high = middle - 1;
  }
  return low;
}

// Writes where vertex v is in step k into out[at ...].
function place(v, k, share, out, at) {
  const [a, b] = framesOf(k).map(frame => frame + 3 * v);
  const from = [0, 1, 2].map(axis => origin[axis] + quantum[axis] * positions[a + axis]);
  for (let axis = 0; axis < 3; ++axis)
    out[at + axis] = from[axis] + quantum[axis] * (positions[b + axis] - positions[a + axis]) * share;
  if (alongScrew.length > 0) bendAside(bodyOfVertex(v, scene.bodies), k, share, from, out, at);
}
