// SPDX-License-Identifier: Apache-2.0
// WebGL2 programs: the mesh (faces, edges or points) between two frames, and the marks of what was found.
const bodyColumns = 1024;  // of a texture with a texel a body: any WebGL2 allows twice as many
const meshVertex = `#version 300 es
in vec3 from, to;
in float body;
uniform float share;
uniform vec3 origin, quantum;
uniform mat4 camera;
uniform float pixels;  // of a point
uniform sampler2D bodies;  // a texel a body: colour; opacity 1: shown, 0.5: cut open, 0: hidden
uniform highp sampler2D arcs;  // two texels a body: see screws.js
out vec3 at;
out vec4 color;
void main() {
  ivec2 texel = ivec2(int(body) % ${bodyColumns}, int(body) / ${bodyColumns});
  at = origin + quantum * mix(from, to, share);
  vec4 angular = texelFetch(arcs, texel * ivec2(2, 1), 0);
  if (angular.w != 0.0) {
    vec4 linear = texelFetch(arcs, texel * ivec2(2, 1) + ivec2(1, 0), 0);
    vec3 bend = cross(angular.xyz, cross(angular.xyz, origin + quantum * from) + linear.xyz);
    at += angular.w * bend + linear.w * cross(angular.xyz, bend);
  }
  color = texelFetch(bodies, texel, 0);
  gl_PointSize = pixels;
  gl_Position = color.a > 0.0 ? camera * vec4(at, 1) : vec4(2, 2, 2, 1);
}`;
// Of a body that is cut open, the half towards the eye is not there.
const cutOpen = `
uniform vec3 back, middle;
bool cutAway(vec3 at, float opacity) { return opacity < 0.9 && dot(at - middle, back) > 0.0; }`;
const faceFragment = `#version 300 es
precision highp float;
in vec3 at;
in vec4 color;
uniform vec3 up;
out vec4 pixel;
${cutOpen}
void main() {
  if (cutAway(at, color.a)) discard;
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));  // of the face itself: flat
  float facing = abs(dot(normal, back));
  float sky = dot(normal, up) * sign(dot(normal, back)) * 0.5 + 0.5;
  pixel = vec4(color.rgb * (0.42 + 0.38 * facing + 0.26 * sky), 1);
}`;
const edgeFragment = `#version 300 es
precision highp float;
in vec3 at;
in vec4 color;
uniform vec4 ink;
out vec4 pixel;
${cutOpen}
void main() {
  if (cutAway(at, color.a)) discard;
  pixel = ink;
}`;
// Edges and points of no face: the body's own hue, so strong that it shows on the ground.
const loneFragment = (round) => `#version 300 es
precision highp float;
in vec3 at;
in vec4 color;
uniform vec2 strength;
out vec4 pixel;
void main() {
  ${round ? "if (length(gl_PointCoord - 0.5) > 0.5) discard;" : ""}
  pixel = vec4(strength.x * color.rgb + strength.y, 1);
}`;

// Points are marks of the shapes that asked.js numbers; lines are edges of what they mark.
const contactVertex = `#version 300 es
in vec3 at;
in vec4 look;  // colour, and opacity
in float shape;
uniform mat4 camera;
uniform float pixels;
uniform vec3 nearer;  // towards the eye: a mark lies on what it marks
out vec4 color;
flat out float kind;
void main() {
  color = look;
  kind = shape;
  gl_Position = camera * vec4(at + nearer, 1);
  gl_PointSize = pixels * (shape > 1.5 ? 1.3 : shape > 0.5 ? 1.15 : 1.0);
}`;
const pointFragment = `#version 300 es
precision highp float;
in vec4 color;
flat in float kind;
uniform vec3 rim;
uniform float opacity, inner;
out vec4 pixel;
void main() {
  vec2 p = 2.0 * gl_PointCoord - 1.0;
  float r = length(p);
  if (kind > 3.5) r = 2.0 * max(-p.y, 0.866 * abs(p.x) + 0.5 * p.y);
  else if (kind > 2.5) r = 1.3 * max(abs(p.x), abs(p.y));
  else if (kind > 1.5) r = 2.0 * max(p.y, 0.866 * abs(p.x) - 0.5 * p.y);
  else if (kind > 0.5) r = abs(p.x) + abs(p.y);
  if (r > 1.0) discard;
  pixel = vec4(mix(color.rgb, rim, smoothstep(inner - 0.06, inner + 0.06, r)), color.a * opacity * (1.0 - smoothstep(0.9, 1.0, r)));
}`;
const lineFragment = `#version 300 es
precision highp float;
in vec4 color;
flat in float kind;
uniform float opacity;
out vec4 pixel;
void main() { pixel = vec4(color.rgb, color.a * opacity); }`;

function makeProgram(gl, vertex, fragment, attributes) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  attributes.forEach((name, index) => gl.bindAttribLocation(program, index, name));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
    const { name } = gl.getActiveUniform(program, i);
    uniforms[name] = gl.getUniformLocation(program, name);
  }
  return { program, uniforms };
}
