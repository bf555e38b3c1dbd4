// SPDX-License-Identifier: Apache-2.0
// The page as a whole: one time, shown by the picture, the slider, the charts and in words.
const byId = id => document.getElementById(id);
const picture = makePicture();
let time = 0, playing = false, waiting = false;

function words(t) {
  const k = stepAt(t), [first, end] = contactsOf(k);
  const count = t > 0 ? scene.vf[k - 1] + scene.ee[k - 1] : 0;
  const listed = end - first;
  return `frame ${(scene.steps[0] - 1 + t).toFixed(2)}, ${number(count)} contacts` +
         (count > 0 && listed < scene.vf[k - 1] + scene.ee[k - 1] ? ` (${number(listed)} listed)` : "");
}

function draw() {
  waiting = false;
  picture.draw(time);
  byId("time").value = time;
  byId("time").setAttribute("aria-valuetext", words(time));
  byId("now").textContent = words(time);
  charts.forEach(chart => chart.cursor(time));
}
function redraw() {
  if (!waiting) requestAnimationFrame(draw);
  waiting = true;
}
function seek(t) {
  time = Math.min(stepCount, Math.max(0, t));
  redraw();
}
function play(on) {
  playing = on;
  byId("play").innerHTML = on ? "&#10074;&#10074;" : "&#9654;";
  byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  if (!on) return;
  if (time >= stepCount) time = 0;
  let last = performance.now();
  requestAnimationFrame(function tick(now) {
    if (!playing) return;
    time += Math.max(0, now - last) / 1000 * Number(byId("speed").value);
    last = now;
    if (time >= stepCount) {
      time = stepCount;
      play(false);
    }
    draw();
    requestAnimationFrame(tick);
  });
}

const charts = [
  makeChart("contacts-chart", ["vf", "ee"].map(name => ({ name, values: scene[name] })), seek, showTip),
  makeChart("times-chart", ["refit", "front", "elementary", "adjacent"].map(name => ({ name, values: scene.ms[name] })), seek,
            showTip),
];

function title() {
  const range = `${number(scene.triangles)} triangles, ${number(scene.vertices)} vertices, ${number(stepCount)} step${stepCount === 1 ? "" : "s"}`;
  const how = `${scene.tier}${scene.tier === "certified" ? " " + scene.tolerance.toExponential() : ""}` +
              (scene.min_separation > 0 ? `, separation ${scene.min_separation}` : "") +
              `, front ${scene.front}, bounds ${scene.bounds}, ${scene.threads} thread${scene.threads === 1 ? "" : "s"}`;
  byId("title").textContent = document.title = scene.name;
  byId("subtitle").textContent = `${range} · ${how}`;
  byId("foot").textContent = `Positions are drawn within ${scene.error.toExponential(1)} of the scene's` +
    (scene.contacts_hash ? `; contacts_hash ${scene.contacts_hash}` : "; contacts were counted, not listed");
}

function bodyList() {
  // More than this many bodies are a crowd, not a list.
  if (scene.bodies.length < 2 || scene.bodies.length > 24) return;
  scene.bodies.forEach((body, b) => {
    const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("span");
    const kind = document.createElement("span");
    Object.assign(box, { type: "checkbox", checked: true });
    box.addEventListener("change", () => { picture.show(b, box.checked); redraw(); });
    swatch.className = "swatch";
    swatch.dataset.body = b;
    kind.className = "kind";
    kind.textContent = ` ${body.kind}`;
    label.append(box, swatch, body.name || `body ${b}`, kind);
    byId("bodies").append(label);
  });
}
function recolor() {
  byId("ramp").style.background = `linear-gradient(to right, ${ramp.map(css).join(", ")})`;
  document.querySelectorAll(".swatch").forEach(s => { s.style.background = css(bodyColor(Number(s.dataset.body))); });
  picture.recolor();
  redraw();
}

const keys = {
  " ": () => play(!playing),
  ArrowLeft: event => seek(Math.ceil(time) - (event.shiftKey ? 10 : 1)),
  ArrowRight: event => seek(Math.floor(time) + (event.shiftKey ? 10 : 1)),
  Home: () => seek(0),
  End: () => seek(stepCount),
  0: () => { camera.reset(); redraw(); },
};
addEventListener("keydown", event => {
  if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
  if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName) && event.key === " ") return;
  if (event.target.tagName === "SELECT") return;
  event.preventDefault();
  keys[event.key](event);
});
byId("play").addEventListener("click", () => play(!playing));
byId("time").max = stepCount;
byId("time").addEventListener("input", event => seek(Number(event.target.value)));
for (const name of ["faces", "edges", "contacts"])
  byId(`${name}-on`).addEventListener("change", event => { shown[name] = event.target.checked; redraw(); });
byId("up").addEventListener("change", event => { camera.up = event.target.value; redraw(); });
dark.addEventListener("change", recolor);
const resized = () => { charts.forEach(chart => chart.draw()); draw(); };
addEventListener("resize", resized);
// page.html#frame=12.5&up=y opens there and so; else where the most contacts are, with z up.
function openAt() {
  const asked = /frame=([\d.]+)/.exec(location.hash), up = /up=([yz])/.exec(location.hash);
  if (up) camera.up = byId("up").value = up[1];
  const totals = scene.steps.map((_, i) => scene.vf[i] + scene.ee[i]);
  seek(asked ? Number(asked[1]) - (scene.steps[0] - 1) : 1 + totals.indexOf(Math.max(...totals)));
}
addEventListener("hashchange", openAt);

title();
bodyList();
followPointer(redraw);
openAt();
recolor();
resized();
// For scripts: where the page is, and a drawing of it now.
window.warmfront = { scene, seek: t => { seek(t); draw(); }, get time() { return time; }, get playing() { return playing; }, picture };
