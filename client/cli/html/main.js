// SPDX-License-Identifier: Apache-2.0
// The page as a whole: one time, shown by the picture, the slider, the charts and in words.
const byId = id => document.getElementById(id);
const picture = makePicture();
let time = 0, playing = false, waiting = false;

function words(t) {
  const k = stepAt(t), [first, end] = contactsOf(k);
  const count = isAsked(t) ? totalOf(k - 1) : 0;
  const listed = end - first;
  const frame = states ? scene.steps[k - 1] : (firstFrame + t).toFixed(2);
  return `frame ${frame}, ${number(count)} ${count === 1 ? asked.thing : asked.things}` +
         (count > listed ? ` (${number(listed)} listed)` : "");
}

function draw() {
  waiting = false;
  picture.draw(time);
  byId("time").value = wholeIfState(time);
  byId("time").setAttribute("aria-valuetext", words(time));
  byId("now").textContent = words(time);
  charts.forEach(chart => chart.cursor(time));
}
function redraw() {
  if (!waiting) requestAnimationFrame(draw);
  waiting = true;
}
function seek(t) {
  time = Math.min(lastTime, Math.max(0, wholeIfState(t)));
  redraw();
}
function play(on) {
  playing = on;
  byId("play").innerHTML = on ? "&#10074;&#10074;" : "&#9654;";
  byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  time = wholeIfState(time);
  if (!on) return;
  if (time >= lastTime) time = 0;
  let last = performance.now();
  requestAnimationFrame(function tick(now) {
    if (!playing) return;
    time += Math.max(0, now - last) / 1000 * Number(byId("speed").value);
    last = now;
    if (time >= stepCount) {  // the last state is shown as long as the others
      time = lastTime;
      play(false);
    }
    draw();
    requestAnimationFrame(tick);
  });
}

const charts = [
  makeChart("contacts-chart", asked.shown.map(name => ({ name, values: asked.counts[name] })), seek, showTip),
  makeChart("times-chart", asked.stages.map(name => ({ name, values: scene.ms[name] })), seek, showTip),
];

function title() {
  const points = pointsOf(parts[0]).length;
  const counts = [plural(scene.triangles, "triangle"), scene.edges > 0 && plural(scene.edges, "edge"),
    points > 0 && plural(points, "point"),
    `${number(scene.vertices)} ${scene.vertices === 1 ? "vertex" : "vertices"}`].filter(Boolean).join(", ");
  const changes = parts.length === 1 ? "" : `; the topology changes ${parts.length === 2 ? "once" : `${parts.length - 1} times`}`;
  const range = `${counts}${changes && " at first"}, ${plural(stepCount, states ? "frame" : "step")}${changes}`;
  byId("title").textContent = document.title = scene.name;
  byId("subtitle").textContent = `${range} · ${asked.how}`;
  byId("foot").textContent = `Positions are drawn within ${scene.error.toExponential(1)} of the scene's` +
    (scene.contacts_hash ? `; contacts_hash ${scene.contacts_hash}` : states ? "" : "; contacts were counted, not listed");
}

// What marks and colours stand for. Of states only the kinds that occur, or all where none does.
function legends() {
  const occur = asked.shown.filter(kind => !states || asked.counts[kind].some(count => count > 0));
  const named = occur.length > 0 ? occur : asked.shown;
  const key = (name, text) => `<span class="key ${name}">${text}</span> `;
  document.querySelectorAll(".things").forEach(span => { span.textContent = asked.things; });
  document.querySelector("#legend .name").textContent = asked.ramp ? asked.ramp.name : asked.how;
  document.querySelector("#legend .ends").innerHTML = asked.ramp ? asked.ramp.ends.map(end => `<span>${end}</span>`).join("") : "";
  document.querySelector("#legend .marks").innerHTML =
    named.map(kind => `<span><span class="${kinds[kind].mark}"></span>${kinds[kind].name}</span>`).join(" ");
  byId("ramp").hidden = !asked.ramp;
  const nameOf = kind => kinds[kind].name + (kind === "ee" && asked.counts !== scene.rows ? orOfPoints : "");
  byId("contacts-keys").innerHTML = named.map(kind => key(kind, nameOf(kind))).join("");
  byId("times-keys").innerHTML = asked.stages.length > 1 ? asked.stages.map(stage => key(stage, stage)).join("") : "";
  canvas.setAttribute("aria-label", `The meshes, with ${asked.coloured}`);
  byId("contacts-chart").setAttribute("aria-label", `${asked.things[0].toUpperCase()}${asked.things.slice(1)} of each frame`);
  byId("times-chart").setAttribute("aria-label", asked.stages.length > 1 ? "Stage times of each frame" : "Time of each frame");
}

function bodyList() {
  if (scene.bodies.length < 2) return;
  // More than this many bodies are a crowd, not a list.
  if (scene.bodies.length > 1000) {
    byId("bodies").textContent = `${number(scene.bodies.length)} bodies, too many to list` +
      (open.size > 0 ? `; ${number(open.size)} cut open` : "");
    return;
  }
  const faced = facedVertices(parts[0]), boxes = [];
  const addBox = changed => {
    const label = document.createElement("label"), box = document.createElement("input");
    Object.assign(box, { type: "checkbox", checked: true });
    box.addEventListener("change", () => { changed(box.checked); redraw(); });
    label.append(box);
    byId("bodies").append(label);
    return [label, box];
  };
  if (scene.bodies.length > 4) {
    const [label] = addBox(on => boxes.forEach((box, b) => { box.checked = on; picture.show(b, on); }));
    label.append("all bodies");
  }
  scene.bodies.forEach((body, b) => {
    const [label, box] = addBox(on => picture.show(b, on));
    boxes.push(box);
    const swatch = document.createElement("span"), kind = document.createElement("span");
    swatch.className = "swatch";
    swatch.dataset.body = b;
    if (!body.half_space && !isFaced(body, faced)) swatch.dataset.lone = "yes";
    kind.className = "kind";
    kind.textContent = ` ${body.kind}${body.screw ? ", along a screw" : ""}${open.has(b) ? ", cut open" : ""}`;
    label.append(swatch, body.name || `body ${b}`, kind);
  });
}
function recolor() {
  byId("ramp").style.background = `linear-gradient(to right, ${ramp.map(css).join(", ")})`;
  document.querySelectorAll(".swatch").forEach(s => {
    s.style.background = css((s.dataset.lone ? loneColor : bodyColor)(Number(s.dataset.body)));
  });
  picture.recolor();
  redraw();
}

const keys = {
  " ": () => play(!playing),
  ArrowLeft: event => seek(Math.ceil(wholeIfState(time)) - (event.shiftKey ? 10 : 1)),
  ArrowRight: event => seek(Math.floor(time) + (event.shiftKey ? 10 : 1)),
  Home: () => seek(0),
  End: () => seek(lastTime),
  0: () => { camera.reset(); redraw(); },
  f: () => { picture.frame(time); redraw(); },
};
canvas.addEventListener("dblclick", keys.f);
addEventListener("keydown", event => {
  if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
  // Space presses what has the focus, but for the slider, which has no use for it.
  if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName) && event.target.type !== "range" && event.key === " ") return;
  if (event.target.tagName === "SELECT") return;
  event.preventDefault();
  keys[event.key](event);
});
byId("play").addEventListener("click", () => play(!playing));
Object.assign(byId("time"), { max: lastTime, step: states ? 1 : 0.01 });
byId("play").disabled = lastTime === 0;
byId("time").addEventListener("input", event => seek(Number(event.target.value)));
// What the scene has none of needs no box.
const has = {
  faces: faces.length > 0, wireframe: faces.length > 0, edges: loneEdges.length > 0, points: parts.some(part => pointsOf(part).length > 0),
  grounds: halfSpaces.length > 0, contacts: true,
};
for (const name in shown) {
  const box = byId(`${name}-on`);
  box.parentElement.hidden = !has[name];
  box.addEventListener("change", () => { shown[name] = box.checked; redraw(); });
}
byId("up").addEventListener("change", event => { camera.up = event.target.value; redraw(); });
dark.addEventListener("change", recolor);
const resized = () => { charts.forEach(chart => chart.draw()); draw(); };
addEventListener("resize", resized);
// page.html#frame=12.5&up=y opens there and so; else where the most is found, with z up.
function openAt() {
  const to = Number((/frame=([\d.]+)/.exec(location.hash) ?? [])[1] || NaN), up = /up=([yz])/.exec(location.hash);
  if (up) camera.up = byId("up").value = up[1];
  const totals = scene.steps.map((_, i) => totalOf(i));
  seek(Number.isFinite(to) ? to - firstFrame : timeOf(1 + totals.indexOf(Math.max(...totals))));
}
addEventListener("hashchange", openAt);

title();
legends();
bodyList();
followPointer(redraw);
openAt();
recolor();
resized();
// For scripts: where the page is, and a drawing of it now.
window.warmfront = { scene, seek: t => { seek(t); draw(); }, get time() { return time; }, get playing() { return playing; }, picture,
  // Where vertex v is at time t, in the scene's coordinates.
  where(v, t) {
    const at = [];
    place(v, stepAt(t), shareAt(t), at, 0);
    return at.map((x, axis) => scene.origin[axis] + (x - origin[axis]) * (largest > 0 ? largest : 1));
  },
};
