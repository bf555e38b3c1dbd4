// SPDX-License-Identifier: Apache-2.0
// The picture: canvas, what is shown on it, and the pointer over it.
const canvas = document.getElementById("view");
const shown = { faces: true, wireframe: true, edges: true, points: true, grounds: true, contacts: true };

function makePicture() {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
  if (!gl) {
    const unable = document.getElementById("unable");
    unable.hidden = false;
    unable.textContent = "This browser has no WebGL2, so the meshes cannot be drawn; the charts below are complete.";
    return { draw() {}, show() {}, recolor() {}, frame() {} };
  }
  const mesh = makeMesh(gl), contacts = makeContacts(gl), grounds = makeHalfSpaces(gl);
  return {
    gl,
    show: mesh.show,
    frame(t) {
      const corners = cornersAt(t, mesh.isHidden);
      if (corners) camera.frame(...corners, aspect());
    },
    recolor: mesh.colorBodies,
    draw(t) {
      const width = Math.round(canvas.clientWidth * devicePixelRatio);
      const height = Math.round(canvas.clientHeight * devicePixelRatio);
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      const k = stepAt(t), share = shareAt(t), matrix = camera.matrix(width / Math.max(height, 1));
      gl.viewport(0, 0, width, height);
      gl.clearColor(...groundColor(), 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      if (shown.faces) {
        // Behind the edges that bound them.
        gl.enable(gl.POLYGON_OFFSET_FILL);
        gl.polygonOffset(1, 1);
        mesh.drawFaces(k, share, matrix);
        gl.disable(gl.POLYGON_OFFSET_FILL);
      }
      if (shown.grounds) grounds.draw(matrix, mesh.isHidden);
      if (shown.edges) mesh.drawLoneEdges(k, share, matrix);
      if (shown.points) mesh.drawPoints(k, share, matrix);
      if (shown.wireframe) {
        gl.enable(gl.BLEND);
        mesh.drawWireframe(k, share, matrix);
        gl.disable(gl.BLEND);
      }
      const bodies = partOf(k).bodies;
      if (shown.contacts && isAsked(t)) contacts.draw(k, share, matrix, v => !mesh.isHidden(bodyOfVertex(v, bodies)));
    },
  };
}

const aspect = () => canvas.clientWidth / Math.max(canvas.clientHeight, 1);

// The corners of the box around all vertices that are shown at a time; null where none is.
function cornersAt(t, isHidden) {
  const k = stepAt(t), share = shareAt(t), bodies = partOf(k).bodies, at = [0, 0, 0];
  const low = [Infinity, Infinity, Infinity], high = low.map(x => -x);
  bodies.forEach((body, b) => {
    if (isHidden(b)) return;
    for (let v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v) {
      place(v, k, share, at, 0);
      for (let axis = 0; axis < 3; ++axis) {
        low[axis] = Math.min(low[axis], at[axis]);
        high[axis] = Math.max(high[axis], at[axis]);
      }
    }
  });
  return low[0] > high[0] ? null : [low, high];
}

// Turning, moving and zooming with a mouse, a pen or fingers.
function followPointer(redraw) {
  const down = new Map();
  const placeOf = (x, y) => {
    const box = canvas.getBoundingClientRect();
    return [2 * (x - box.left) / box.width - 1, 1 - 2 * (y - box.top) / box.height];
  };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });
  const up = event => down.delete(event.pointerId);
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointermove", event => {
    const last = down.get(event.pointerId);
    if (!last) return;
    const dx = (event.clientX - last[0]) / canvas.clientHeight, dy = (event.clientY - last[1]) / canvas.clientHeight;
    if (down.size === 2) {
      const other = [...down].find(([id]) => id !== event.pointerId)[1];
      const apart = (x, y) => Math.hypot(x - other[0], y - other[1]) + 1;
      camera.zoom(apart(...last) / apart(event.clientX, event.clientY), placeOf(event.clientX, event.clientY), aspect());
      camera.move(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) {
      camera.move(0.62 * dx, 0.62 * dy);
    } else {
      camera.rotate(4 * dx, 4 * dy);
    }
    down.set(event.pointerId, [event.clientX, event.clientY]);
    redraw();
  });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    camera.zoom(Math.exp(0.0012 * event.deltaY), placeOf(event.clientX, event.clientY), aspect());
    redraw();
  }, { passive: false });
}
