// SPDX-License-Identifier: Apache-2.0
// An orbiting camera: turn, move, zoom. Matrices are column-major, as WebGL takes them.
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, s) => a.map(x => x * s);
const plus = (a, b) => a.map((x, i) => x + b[i]);
const unit = a => scaled(a, 1 / Math.hypot(...a));

const size = Math.hypot(...extent) || 1;
const middle = [0, 0, 0];
const margin = 1.06;  // around the scene
// How the camera's x and y are scaled: half of the field of view is 0.3, of the height, or of a narrow page's width.
const scaleOf = aspect => {
  const f = 1 / Math.tan(0.3);
  return aspect < 1 ? [f, f * aspect] : [f / aspect, f];
};

// The corners of those cells of the bounding box in which anything ever is: what a view of all must contain.
function reachedCorners() {
  const cells = 24, reached = new Uint8Array(cells ** 3);
  const cell = at => Math.floor(positions[at] * cells / 65536);
  for (let i = 0; i < positions.length; i += 3) reached[(cell(i) * cells + cell(i + 1)) * cells + cell(i + 2)] = 1;
  const corners = [];
  reached.forEach((is, at) => {
    if (!is) return;
    const low = [Math.floor(at / cells ** 2), Math.floor(at / cells) % cells, at % cells];
    for (let i = 0; i < 8; ++i) corners.push(low.map((n, axis) => extent[axis] * ((n + (i >> axis & 1)) / cells - 0.5)));
  });
  return corners;
}
const scope = reachedCorners();

const camera = {
  up: "z",
  reset() {
    this.center = middle;
    this.turn = 0.6;
    this.tilt = 0.32;
    this.distance = 2 * size;
    this.fitted = "";
  },
  // Until the view is turned, moved or zoomed, the scene is in it whole, whatever the aspect.
  fit(aspect) {
    const asked = `${aspect} ${this.up}`;
    if (this.fitted === null || this.fitted === asked) return;
    this.fitted = asked;
    this.distance = this.needed(scope, aspect, 0.1 * size);
  },
  // How far the centre is from an eye that sees all of what is so beside it; at least `least`.
  needed(corners, aspect, least) {
    const [x, y, z] = this.axes(), p = scaleOf(aspect);
    const ofOne = c => dot(c, z) + margin * Math.max(p[0] * Math.abs(dot(c, x)), p[1] * Math.abs(dot(c, y)));
    return corners.reduce((most, c) => Math.max(most, ofOne(c)), least);
  },
  // The direction from the centre to the eye.
  back() {
    const flat = [Math.cos(this.tilt) * Math.cos(this.turn), Math.cos(this.tilt) * Math.sin(this.turn)];
    return this.up === "y" ? [flat[0], Math.sin(this.tilt), -flat[1]] : [flat[0], flat[1], Math.sin(this.tilt)];
  },
  axes() {
    const back = this.back();
    const right = unit(cross(this.up === "y" ? [0, 1, 0] : [0, 0, 1], back));
    return [right, cross(back, right), back];
  },
  rotate(dx, dy) {
    this.fitted = null;
    this.turn -= dx;
    this.tilt = Math.min(1.55, Math.max(-1.55, this.tilt + dy));
  },
  move(dx, dy) {
    this.fitted = null;
    const [right, up] = this.axes();
    this.center = plus(this.center, plus(scaled(right, -dx * this.distance), scaled(up, dy * this.distance)));
  },
  // What is at `at`, from -1 to 1 across the picture and up, stays there.
  zoom(factor, at, aspect) {
    this.fitted = null;
    const before = this.distance, [right, up] = this.axes(), p = scaleOf(aspect);
    this.distance = Math.min(20 * size, Math.max(0.005 * size, before * factor));
    const nearer = before - this.distance;
    this.center = plus(this.center, plus(scaled(right, at[0] / p[0] * nearer), scaled(up, at[1] / p[1] * nearer)));
  },
  // What is between two corners of a box fills the view.
  frame(low, high, aspect) {
    this.fitted = null;
    this.center = low.map((x, axis) => (x + high[axis]) / 2);
    const corners = Array.from({ length: 8 }, (_, i) => low.map((x, axis) => (high[axis] - x) * ((i >> axis & 1) - 0.5)));
    this.distance = this.needed(corners, aspect, 0.02 * size);
  },
  matrix(aspect) {
    this.fit(aspect);
    const [x, y, z] = this.axes();
    const eye = plus(this.center, scaled(z, this.distance));
    const away = Math.hypot(...plus(eye, scaled(middle, -1)));
    // All that is drawn: the box, with what arcs have beside it, and the grids of half-spaces.
    const reach = halfSpaces.length > 0 ? 2.5 : size;
    const near = Math.max(away - reach, 0.005 * size), far = away + reach;
    const p = scaleOf(aspect);
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const t = [-dot(x, eye), -dot(y, eye), -dot(z, eye)];
    return new Float32Array([
      p[0] * x[0], p[1] * y[0], a * z[0], -z[0],
      p[0] * x[1], p[1] * y[1], a * z[1], -z[1],
      p[0] * x[2], p[1] * y[2], a * z[2], -z[2],
      p[0] * t[0], p[1] * t[1], a * t[2] + b, -t[2],
    ]);
  },
};
camera.reset();
