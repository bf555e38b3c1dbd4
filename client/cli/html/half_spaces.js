// SPDX-License-Identifier: Apache-2.0
// Half-spaces: a grid on the plane of each, wide around the scene. Those of a page stand still.

const halfSpaces = scene.bodies.flatMap((body, b) => (body.half_space ? [{ b, ...body.half_space }] : []));

// Ends of lines, three numbers each, as they are drawn.
function gridOf({ point, normal }) {
  const length = Math.max(...normal.map(Math.abs));
  const n = normal.map(x => x / length), n2 = dot(n, n);
  const p = point.map((x, axis) => origin[axis] + (largest > 0 ? (x - scene.origin[axis]) / largest : 0));
  const foot = n.map(x => x * dot(n, p) / n2);  // of the scene's middle, which is at 0
  const axis = n.map(Math.abs).indexOf(Math.min(...n.map(Math.abs)));
  const across = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = a => a.map(x => x / Math.hypot(...a));
  const u = unit(across(n, [0, 1, 2].map(k => (k === axis ? 1 : 0)))), v = unit(across(n, u));
  const cells = 24, reach = 1.5;
  const at = (s, t) => foot.map((x, k) => x + s * u[k] + t * v[k]);
  const lines = [];
  for (let i = 0; i <= cells; ++i) {
    const s = reach * (2 * i / cells - 1);
    lines.push(...at(s, -reach), ...at(s, reach), ...at(-reach, s), ...at(reach, s));
  }
  return lines;
}

function makeHalfSpaces(gl) {
  if (halfSpaces.length === 0) return { draw() {} };
  const { program, uniforms } = makeProgram(gl, contactVertex, lineFragment, ["at", "look", "shape"]);
  const grids = halfSpaces.map(gridOf);
  const buffer = gl.createBuffer();
  return {
    draw(matrix, isHidden) {
      const data = [];
      halfSpaces.forEach(({ b }, i) => {
        if (isHidden(b)) return;
        for (let k = 0; k < grids[i].length; k += 3) data.push(...grids[i].slice(k, k + 3), ...bodyColor(b), 0.9, 0);
      });
      gl.useProgram(program);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.STREAM_DRAW);
      gl.uniformMatrix4fv(uniforms.camera, false, matrix);
      gl.uniform1f(uniforms.pixels, 1);
      gl.uniform3fv(uniforms.nearer, [0, 0, 0]);
      gl.uniform1f(uniforms.opacity, 1);
      [3, 4, 1].forEach((floats, index) => {
        gl.enableVertexAttribArray(index);
        gl.vertexAttribPointer(index, floats, gl.FLOAT, false, 32, 4 * [0, 3, 7][index]);
      });
      gl.enable(gl.BLEND);
      gl.drawArrays(gl.LINES, 0, data.length / 8);
      gl.disable(gl.BLEND);
    },
  };
}
