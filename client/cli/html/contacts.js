// SPDX-License-Identifier: Apache-2.0
// What was found in the step at hand: a mark each, and its edges. What is still to come within the step is faint.

// Where segments p0 p1 and q0 q1 (at 0, 3, 6, 9 of x) are closest, the mean of both points, into out[at ...].
function closest(x, out, at) {
  const d1 = [0, 1, 2].map(a => x[3 + a] - x[a]), d2 = [0, 1, 2].map(a => x[9 + a] - x[6 + a]);
  const r = [0, 1, 2].map(a => x[a] - x[6 + a]);
  const a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r), c = dot(d1, r), b = dot(d1, d2), det = a * e - b * b;
  const clamp = s => Math.min(1, Math.max(0, s));
  let s = det > 1e-12 * a * e ? clamp((b * f - c * e) / det) : 0.5;
  const t = e > 0 ? clamp((b * s + f) / e) : 0;
  s = a > 0 ? clamp((b * t - c) / a) : 0;
  for (let k = 0; k < 3; ++k) out[at + k] = (x[k] + s * d1[k] + x[6 + k] + t * d2[k]) / 2;
}

function makeContacts(gl) {
  const attributes = ["at", "look", "shape"];
  const point = makeProgram(gl, contactVertex, pointFragment, attributes);
  const line = makeProgram(gl, contactVertex, lineFragment, attributes);
  const buffer = gl.createBuffer();
  const row = 8;  // at, look, shape: floats

  // Marks first, then the ends of lines.
  function vertices(k, share, isShown) {
    const [first, end] = contactsOf(k);
    const rows = [];
    for (let c = first; c < end; ++c) if (isShown(contactV[corners * c])) rows.push(c);
    const ends = rows.reduce((sum, c) => sum + kindOf(c).ends.length, 0);
    const data = new Float32Array(row * (rows.length + ends));
    const x = new Float64Array(12);
    let next = row * rows.length;
    rows.forEach((c, i) => {
      const kind = kindOf(c);
      const come = states || contactValue[c] <= share + 1e-9;
      const look = [...rampColor(contactValue[c]), come ? 1 : 0.3, marks.indexOf(kind.mark)];
      kind.between.forEach((corner, j) => place(contactV[corners * c + corner], k, share, x, 3 * j));
      closest(x, data, row * i);
      data.set(look, row * i + 3);
      for (const corner of kind.ends) {
        place(contactV[corners * c + corner], k, share, data, next);
        data.set(look, next + 3);
        next += row;
      }
    });
    return [data, rows.length, ends];
  }

  function drawWith({ program, uniforms }, mode, start, count, matrix, pixels, opacity) {
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.camera, false, matrix);
    gl.uniform1f(uniforms.pixels, pixels * devicePixelRatio);
    gl.uniform1f(uniforms.inner, pixels > 6 ? 0.66 : 2);  // small marks have no rim
    gl.uniform3fv(uniforms.nearer, scaled(camera.back(), 0.003 * size));
    gl.uniform1f(uniforms.opacity, opacity);
    gl.uniform3fv(uniforms.rim, groundColor());
    [3, 4, 1].forEach((floats, index) => {
      gl.enableVertexAttribArray(index);
      gl.vertexAttribPointer(index, floats, gl.FLOAT, false, 4 * row, 4 * [0, 3, 7][index]);
    });
    gl.drawArrays(mode, start, count);
  }

  return {
    draw(k, share, matrix, isShown) {
      const [data, count, ends] = vertices(k, share, isShown);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STREAM_DRAW);
      gl.enable(gl.BLEND);
      const pixels = Math.min(10, Math.max(3.5, 10 * Math.sqrt(150 / Math.max(count, 1))));
      // What lies behind something shines through a little.
      for (const [test, opacity] of [[false, dark.matches ? 0.4 : 0.25], [true, 1]]) {
        (test ? gl.enable : gl.disable).call(gl, gl.DEPTH_TEST);
        if (count < 3000) drawWith(line, gl.LINES, count, ends, matrix, pixels, opacity);
        drawWith(point, gl.POINTS, 0, count, matrix, pixels, opacity);
      }
      gl.disable(gl.BLEND);
    },
  };
}
