// SPDX-License-Identifier: Apache-2.0
// An orbiting camera: turn, move, zoom. Matrices are column-major, as WebGL takes them.
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, s) => a.map(x => x * s);
const plus = (a, b) => a.map((x, i) => x + b[i]);
const unit = a => scaled(a, 1 / Math.hypot(...a));

const size = Math.hypot(...extent) || 1;
const middle = [0, 0, 0];

const camera = {
  up: "z",
  reset() {
    this.center = middle;
    this.turn = 0.6;
    this.tilt = 0.32;
    this.distance = 1.06 * size;
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
    this.turn -= dx;
    this.tilt = Math.min(1.55, Math.max(-1.55, this.tilt + dy));
  },
  move(dx, dy) {
    const [right, up] = this.axes();
    this.center = plus(this.center, plus(scaled(right, -dx * this.distance), scaled(up, dy * this.distance)));
  },
  zoom(factor) {
    this.distance = Math.min(20 * size, Math.max(0.005 * size, this.distance * factor));
  },
  matrix(aspect) {
    const [x, y, z] = this.axes();
    const eye = plus(this.center, scaled(z, this.distance));
    const away = Math.hypot(...plus(eye, scaled(middle, -1)));
    const near = Math.max(away - 0.55 * size, 0.005 * size), far = away + 0.55 * size;
    const f = 1 / Math.tan(0.3);  // half of the vertical field of view
    const p = aspect < 1 ? [f, f * aspect] : [f / aspect, f];  // a narrow page shows as much at the sides
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
