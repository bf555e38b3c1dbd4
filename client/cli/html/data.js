// SPDX-License-Identifier: Apache-2.0
// What the page carries: see client/cli/html_page.h for its layout.
const scene = JSON.parse(document.getElementById("scene").textContent);

function bytesOf(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}

const faces = new Uint32Array(bytesOf("faces"));          // (m, 3)
const positions = new Uint16Array(bytesOf("positions"));  // (frames, n, 3), in quanta from the origin
const contactV = new Uint32Array(bytesOf("contact-v"));   // (k, 4)
const contactToi = new Float32Array(bytesOf("contact-toi"));
const contactKind = new Uint8Array(bytesOf("contact-kind"));  // 0 vertex-face, 1 edge-edge

// However far away and however small the scene is: drawn, its motion's extent is around 0, and 1 at most.
const extent = scene.quantum.map(q => 65535 * q);
const largest = Math.max(...extent);
extent.forEach((e, axis) => { extent[axis] = largest > 0 ? e / largest : 0; });
const quantum = extent.map(e => e / 65535), origin = extent.map(e => -e / 2);

const vertexCount = scene.vertices;
const stepCount = scene.steps.length;

// Time t in [0, stepCount]: step k (from 1) is under way in (k - 1, k].
const stepAt = t => Math.min(stepCount, Math.max(1, Math.ceil(t)));
const shareAt = t => t - (stepAt(t) - 1);

// The contacts of step k are rows [first, end).
function contactsOf(k) {
  return [k > 1 ? scene.contact_ends[k - 2] : 0, scene.contact_ends[k - 1]];
}

// Writes where vertex v is at time t into out[at ...].
function place(v, k, share, out, at) {
  const a = 3 * ((k - 1) * vertexCount + v), b = a + 3 * vertexCount;
  for (let axis = 0; axis < 3; ++axis) {
    const x = positions[a + axis];
    out[at + axis] = origin[axis] + quantum[axis] * (x + (positions[b + axis] - x) * share);
  }
}
