// SPDX-License-Identifier: Apache-2.0
// Bodies that move along a screw within a step: what a vertex has beside its line, as engine/screw.h says.
const alongScrew = scene.bodies.flatMap((body, b) => (body.screw ? [b] : []));
const twistValues = alongScrew.length > 0 ? new Float64Array(bytesOf("twists")) : [];  // (steps, bodies, 9)

// Of step k and the i-th such body, in the coordinates that are drawn: the angular velocity, and that of the scene's middle.
function twistOf(k, i) {
  const [angular, centre, linear] = [0, 3, 6].map(at => twistValues.subarray(9 * ((k - 1) * alongScrew.length + i) + at).subarray(0, 3));
  const arm = [0, 1, 2].map(axis => scene.origin[axis] + 65535 * scene.quantum[axis] / 2 - centre[axis]);
  const scale = largest > 0 ? largest : 1;
  return { angular: [...angular], linear: plus(cross(angular, arm), [...linear]).map(x => x / scale) };
}

// The shares of the bend and of the turn at time s, which are 0 at 0 and 1.
function arcShares(angular, s) {
  const a = Math.hypot(...angular);
  // (1 - cos(a s)) / a^2 and (a s - sin(a s)) / a^3; by series where these would cancel.
  const bend = s => (a < 0.1 ? s * s * (1 / 2 - (a * s) ** 2 / 24 + (a * s) ** 4 / 720) : 2 * (Math.sin(a * s / 2) / a) ** 2);
  const turn = s => (a < 0.1 ? s ** 3 * (1 / 6 - (a * s) ** 2 / 120 + (a * s) ** 4 / 5040) : (a * s - Math.sin(a * s)) / a ** 3);
  return [bend(s) - s * bend(1), turn(s) - s * turn(1)];
}

// By body: eight numbers, `angular` and the bend's share, `linear` and the turn's; zeros for all that move along lines.
const arcs = { k: 0, share: 0, values: new Float32Array(8 * scene.bodies.length) };
function arcsAt(k, share) {
  if (alongScrew.length === 0 || (arcs.k === k && arcs.share === share)) return arcs.values;
  Object.assign(arcs, { k, share });
  alongScrew.forEach((b, i) => {
    const { angular, linear } = twistOf(k, i), [bend, turn] = arcShares(angular, share);
    arcs.values.set([...angular, bend, ...linear, turn], 8 * b);
  });
  return arcs.values;
}

// Adds what the vertex at `from`, of body b, has beside its line to out[at ...].
function bendAside(b, k, share, from, out, at) {
  const arc = arcsAt(k, share).subarray(8 * b, 8 * b + 8), angular = arc.subarray(0, 3);
  const p = cross(angular, plus(cross(angular, from), arc.subarray(4, 7)));
  const q = cross(angular, p);
  for (let axis = 0; axis < 3; ++axis) out[at + axis] += arc[3] * p[axis] + arc[7] * q[axis];
}
