// SPDX-License-Identifier: Apache-2.0
// The meshes: all frames in one buffer on the GPU; a step draws between two places of it.

// Every edge of a part once, as pairs of vertices.
function uniqueEdges(faces, loneEdges, vertexCount) {
  const keys = new Float64Array(faces.length + loneEdges.length / 2);
  const keyOf = (a, b) => Math.min(a, b) * vertexCount + Math.max(a, b);
  for (let i = 0; i < faces.length; i += 3) {
    for (let c = 0; c < 3; ++c) keys[i + c] = keyOf(faces[i + c], faces[i + (c + 1) % 3]);
  }
  for (let i = 0; i < loneEdges.length; i += 2)
    keys[faces.length + i / 2] = keyOf(loneEdges[i], loneEdges[i + 1]);
  keys.sort();
  const edges = [];
  for (let i = 0; i < keys.length; ++i) {
    if (i > 0 && keys[i] === keys[i - 1]) continue;
    edges.push(Math.floor(keys[i] / vertexCount), keys[i] % vertexCount);
  }
  return new Uint32Array(edges);
}

// Bodies around all others, as a box around balls: they are cut open, or nothing could be seen.
function enclosing() {
  const boxes = parts[0].bodies.map(body => {
    const box = [[65535, 65535, 65535], [0, 0, 0]];
    for (let i = 3 * body.first_vertex; i < 3 * (body.first_vertex + body.vertex_count); ++i) {
      box[0][i % 3] = Math.min(box[0][i % 3], positions[i]);
      box[1][i % 3] = Math.max(box[1][i % 3], positions[i]);
    }
    return box;
  });
  const within = (a, b) => [0, 1, 2].every(k => a[0][k] >= b[0][k] && a[1][k] <= b[1][k]);
  return new Set(boxes.length < 2 ? [] : boxes.flatMap((box, b) => (boxes.every(other => within(other, box)) ? [b] : [])));
}

function makeMesh(gl) {
  const attributes = ["from", "to", "body"];
  const face = makeProgram(gl, meshVertex, faceFragment, attributes);
  const edge = makeProgram(gl, meshVertex, edgeFragment, attributes);
  const buffer = (target, data) => {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return made;
  };
  // A texel a body, as wide as any WebGL2 allows; bodies beyond share colours and hiding.
  const width = Math.min(scene.bodies.length, 2048);
  const frames = buffer(gl.ARRAY_BUFFER, positions);
  // What a part draws, made when it is first drawn.
  const topologyOf = part => {
    if (part.topology) return part.topology;
    const ownFaces = faces.subarray(part.faces, part.faces + 3 * part.triangles);
    const edges = uniqueEdges(ownFaces, loneEdges.subarray(part.loneEdges, part.loneEdges + 2 * part.edges), part.vertices);
    const bodyOf = new Uint16Array(part.vertices);
    part.bodies.forEach((body, b) => bodyOf.fill(b % width, body.first_vertex, body.first_vertex + body.vertex_count));
    part.topology = {
      bodies: buffer(gl.ARRAY_BUFFER, bodyOf),
      faces: buffer(gl.ELEMENT_ARRAY_BUFFER, ownFaces),
      faceCorners: ownFaces.length,
      edges: buffer(gl.ELEMENT_ARRAY_BUFFER, edges),
      edgeEnds: edges.length,
    };
    return part.topology;
  };
  const texture = gl.createTexture();
  const hidden = new Set(), open = enclosing();

  function colorBodies() {
    const texels = new Uint8Array(4 * width);
    for (let b = 0; b < width; ++b)
      texels.set([...bodyColor(b).map(c => Math.round(255 * c)), hidden.has(b) ? 0 : open.has(b) ? 128 : 255], 4 * b);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }
  colorBodies();

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
    gl.vertexAttribPointer(2, 1, gl.UNSIGNED_SHORT, false, 2, 0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
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
    isHidden: b => hidden.has(b % width),
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
    drawEdges(k, share, matrix) {
      const topology = drawWith(edge, k, share, matrix);
      gl.uniform4fv(edge.uniforms.ink, edgeColor());
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, topology.edges);
      gl.drawElements(gl.LINES, topology.edgeEnds, gl.UNSIGNED_INT, 0);
    },
  };
}
