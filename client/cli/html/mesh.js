// SPDX-License-Identifier: Apache-2.0
// The meshes: all frames in one buffer on the GPU; a step draws between two places of it.

// Every edge of a part's faces once, as pairs of vertices.
function uniqueEdges(faces, vertexCount) {
  const keys = new Float64Array(faces.length);
  const keyOf = (a, b) => Math.min(a, b) * vertexCount + Math.max(a, b);
  for (let i = 0; i < faces.length; i += 3) {
    for (let c = 0; c < 3; ++c) keys[i + c] = keyOf(faces[i + c], faces[i + (c + 1) % 3]);
  }
  keys.sort();
  const edges = [];
  for (let i = 0; i < keys.length; ++i) {
    if (i > 0 && keys[i] === keys[i - 1]) continue;
    edges.push(Math.floor(keys[i] / vertexCount), keys[i] % vertexCount);
  }
  return new Uint32Array(edges);
}

// Bodies whose faces are around all others, as a box around balls: they are cut open, or nothing could be seen.
function enclosing() {
  const faced = facedVertices(parts[0]);
  const bodies = parts[0].bodies.map((body, b) => ({ ...body, b })).filter(body => body.vertex_count > 0);
  const boxes = bodies.map(body => {
    const box = [[65535, 65535, 65535], [0, 0, 0]];
    for (let i = 3 * body.first_vertex; i < 3 * (body.first_vertex + body.vertex_count); ++i) {
      box[0][i % 3] = Math.min(box[0][i % 3], positions[i]);
      box[1][i % 3] = Math.max(box[1][i % 3], positions[i]);
    }
    return box;
  });
  const within = (a, b) => [0, 1, 2].every(k => a[0][k] >= b[0][k] && a[1][k] <= b[1][k]);
  return new Set(bodies.length < 2 ? [] : bodies.flatMap((body, i) =>
    (isFaced(body, faced) && boxes.every(other => within(other, boxes[i])) ? [body.b] : [])));
}
const open = enclosing();

function makeMesh(gl) {
  const attributes = ["from", "to", "body"];
  const face = makeProgram(gl, meshVertex, faceFragment, attributes);
  const edge = makeProgram(gl, meshVertex, edgeFragment, attributes);
  const lone = makeProgram(gl, meshVertex, loneFragment(false), attributes);
  const point = makeProgram(gl, meshVertex, loneFragment(true), attributes);
  const buffer = (target, data) => {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return made;
  };
  const bodyCount = Math.max(...parts.map(part => part.bodies.length));
  const rows = Math.ceil(bodyCount / bodyColumns);
  const frames = buffer(gl.ARRAY_BUFFER, positions);
  // What a part draws, made when it is first drawn.
  const topologyOf = part => {
    if (part.topology) return part.topology;
    const ownFaces = facesOf(part), ownEdges = loneEdgesOf(part), ownPoints = pointsOf(part);
    const edges = uniqueEdges(ownFaces, part.vertices);
    const bodyOf = new Float32Array(part.vertices);
    part.bodies.forEach((body, b) => bodyOf.fill(b, body.first_vertex, body.first_vertex + body.vertex_count));
    part.topology = {
      bodies: buffer(gl.ARRAY_BUFFER, bodyOf),
      faces: buffer(gl.ELEMENT_ARRAY_BUFFER, ownFaces),
      faceCorners: ownFaces.length,
      edges: buffer(gl.ELEMENT_ARRAY_BUFFER, edges),
      edgeEnds: edges.length,
      loneEdges: buffer(gl.ELEMENT_ARRAY_BUFFER, ownEdges),
      loneEnds: ownEdges.length,
      points: buffer(gl.ELEMENT_ARRAY_BUFFER, ownPoints),
      pointCount: ownPoints.length,
    };
    return part.topology;
  };
  // Colours, and arcs: of all bodies in rows.
  for (const unit of [0, 1]) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }
  const hidden = new Set();

  function colorBodies() {
    const texels = new Uint8Array(4 * bodyColumns * rows);
    for (let b = 0; b < bodyCount; ++b)
      texels.set([...bodyColor(b).map(c => Math.round(255 * c)), hidden.has(b) ? 0 : open.has(b) ? 128 : 255], 4 * b);
    gl.activeTexture(gl.TEXTURE0);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, bodyColumns, rows, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
  }
  colorBodies();

  const arcTexels = new Float32Array(8 * bodyColumns * rows);
  let uploaded = null;
  function takeArcs(k, share) {
    const moment = alongScrew.length > 0 ? `${k} ${share}` : "";
    if (moment === uploaded) return;
    uploaded = moment;
    arcTexels.set(arcsAt(k, share));
    gl.activeTexture(gl.TEXTURE1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 2 * bodyColumns, rows, 0, gl.RGBA, gl.FLOAT, arcTexels);
  }

  function drawWith({ program, uniforms }, k, share, matrix) {
    const topology = topologyOf(partOf(k));
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, frames);
    framesOf(k).forEach((frame, index) => {
      gl.enableVertexAttribArray(index);
      gl.vertexAttribPointer(index, 3, gl.UNSIGNED_SHORT, false, 6, 2 * frame);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, topology.bodies);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribPointer(2, 1, gl.FLOAT, false, 4, 0);
    takeArcs(k, share);
    gl.uniform1i(uniforms.bodies, 0);
    gl.uniform1i(uniforms.arcs, 1);
    gl.uniform1f(uniforms.share, share);
    gl.uniform3fv(uniforms.back, camera.back());
    gl.uniform3fv(uniforms.middle, middle);
    gl.uniform3fv(uniforms.origin, origin);
    gl.uniform3fv(uniforms.quantum, quantum);
    gl.uniformMatrix4fv(uniforms.camera, false, matrix);
    return topology;
  }

  return {
    colorBodies,
    isHidden: b => hidden.has(b),
    show(b, on) {
      if (on) hidden.delete(b); else hidden.add(b);
      colorBodies();
    },
    drawFaces(k, share, matrix) {
      const topology = drawWith(face, k, share, matrix);
      gl.uniform3fv(face.uniforms.up, camera.axes()[1]);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, topology.faces);
      gl.drawElements(gl.TRIANGLES, topology.faceCorners, gl.UNSIGNED_INT, 0);
    },
    drawWireframe(k, share, matrix) {
      const topology = drawWith(edge, k, share, matrix);
      gl.uniform4fv(edge.uniforms.ink, edgeColor());
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, topology.edges);
      gl.drawElements(gl.LINES, topology.edgeEnds, gl.UNSIGNED_INT, 0);
    },
    drawLoneEdges(k, share, matrix) {
      const topology = drawWith(lone, k, share, matrix);
      gl.uniform2fv(lone.uniforms.strength, loneStrength());
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, topology.loneEdges);
      gl.drawElements(gl.LINES, topology.loneEnds, gl.UNSIGNED_INT, 0);
    },
    drawPoints(k, share, matrix) {
      const topology = drawWith(point, k, share, matrix);
      gl.uniform2fv(point.uniforms.strength, loneStrength());
      gl.uniform1f(point.uniforms.pixels, devicePixelRatio * Math.min(7, Math.max(2, 90 / Math.sqrt(topology.pointCount + 1))));
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, topology.points);
      gl.drawElements(gl.POINTS, topology.pointCount, gl.UNSIGNED_INT, 0);
    },
  };
}
