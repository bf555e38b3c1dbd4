// SPDX-License-Identifier: Apache-2.0
// Uses the page as a reader does, and sends home what it saw: test_page.py and test_states_page.py judge it.
(async () => {
  const result = { errors: window.pageErrors };
  const frame = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
  const { picture, scene } = window.warmfront;
  const { gl } = picture;
  const by = id => document.getElementById(id);

  // Pixels drawn last: how many are not ground, how many are warm and saturated as marks are, and all of them to compare.
  function look() {
    picture.draw(window.warmfront.time);
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let drawn = 0, marks = 0, atRim = 0, leftmost = null;
    const width = gl.drawingBufferWidth, height = gl.drawingBufferHeight, coarse = new Array(32 * 20).fill(0);
    for (let i = 0; i < pixels.length; i += 4) {
      const is = Math.abs(pixels[i] - pixels[0]) + Math.abs(pixels[i + 2] - pixels[2]) > 12;
      const x = i / 4 % width, y = Math.floor(i / 4 / width);
      drawn += is;
      if (is && (leftmost === null || x < leftmost[0])) leftmost = [x, y];
      atRim += is && (x < 2 || y < 2 || x >= width - 2 || y >= height - 2);
      coarse[Math.floor(y * 20 / height) * 32 + Math.floor(x * 32 / width)] += is;
      marks += pixels[i] - pixels[i + 2] > 70;
    }
    return { pixels, drawn, marks, atRim, coarse, leftmost };
  }
  // The largest contrast (WCAG 2) that any pixel has to the ground.
  function contrast({ pixels }) {
    const light = i => [0.2126, 0.7152, 0.0722].reduce((sum, part, c) => {
      const s = pixels[i + c] / 255;
      return sum + part * (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
    }, 0.05);
    const ground = light(0);
    let most = 1;
    for (let i = 0; i < pixels.length; i += 4) most = Math.max(most, light(i) / ground, ground / light(i));
    return most;
  }
  const differing = (a, b) => a.pixels.reduce((sum, x, i) => sum + (x !== b.pixels[i]), 0);
  const change = (id, checked) => {
    by(id).checked = checked;
    by(id).dispatchEvent(new Event("change"));
  };
  const press = (key, options = {}) => dispatchEvent(new KeyboardEvent("keydown", { key, ...options, bubbles: true }));
  const at = () => window.warmfront.time;

  try {
    await frame();
    result.size = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    result.dark = matchMedia("(prefers-color-scheme: dark)").matches;
    result.opened = at();
    const opened = look();
    Object.assign(result, { drawn: opened.drawn, marks: opened.marks, atRim: [opened.atRim], coarse: opened.coarse });
    result.boxes = [...document.querySelectorAll("#shown > label")].filter(e => e.offsetHeight > 0).map(e => e.innerText.trim().split(/\s/)[0]);
    result.bodies = by("bodies").innerText.replace(/\s+/g, " ").trim();
    result.scrolls = document.documentElement.scrollHeight - innerHeight;

    change("contacts-on", false);
    result.marksWithout = look().marks;
    // Each kind of thing alone.
    const things = ["faces", "wireframe", "edges", "points", "grounds"];
    result.alone = {};
    for (const name of things) {
      things.forEach(other => change(`${other}-on`, other === name));
      const seen = look();
      result.alone[name] = [seen.drawn, contrast(seen)];
    }
    things.forEach(name => change(`${name}-on`, true));
    change("contacts-on", true);
    change("faces-on", false);
    result.drawnAsEdges = look().drawn;
    change("faces-on", true);

    by("time").value = 0;
    by("time").dispatchEvent(new Event("input"));
    await frame();
    Object.assign(result, { slid: at(), slidWords: by("now").textContent, slidMarks: look().marks });
    const start = look();
    result.atRim.push(start.atRim);
    result.changed = differing(opened, start);
    result.same = differing(start, look());

    press("ArrowRight");
    result.right = at();
    press("ArrowRight", { shiftKey: true });
    result.rightTen = at();
    press("End");
    result.end = at();
    press("ArrowLeft");
    result.left = at();
    await frame();
    result.words = by("now").textContent;

    window.warmfront.seek(0.5);
    result.half = look().coarse;
    window.warmfront.seek(1);
    result.one = look().coarse;
    result.whereHalf = Array.from({ length: Math.min(50, scene.vertices) }, (_, v) => window.warmfront.where(v, 0.5));
    by("time").dispatchEvent(new KeyboardEvent("keydown", { key: " ", bubbles: true }));
    result.spaceOnSlider = window.warmfront.playing !== by("play").disabled;
    if (window.warmfront.playing) press(" ");
    for (const hash of ["frame=.", "frame=1.2.3"]) {
      location.hash = hash;
      await new Promise(done => addEventListener("hashchange", done, { once: true }));
      await frame();
      if (at() !== result.opened) result.errors.push(`#${hash} opens at ${at()}`);
    }
    window.warmfront.seek(result.left);

    const before = look();
    by("view").dispatchEvent(new WheelEvent("wheel", { deltaY: -400, cancelable: true }));
    result.zoomed = differing(before, look());
    press("0");
    result.viewReset = differing(before, look());
    // What the pointer is at stays there.
    if (before.leftmost) {
      const [x, y] = before.leftmost, view = by("view").getBoundingClientRect(), scale = view.width / result.size[0];
      by("view").dispatchEvent(new WheelEvent("wheel", {
        clientX: view.left + (x + 0.5) * scale, clientY: view.bottom - (y + 0.5) * scale, deltaY: -400, cancelable: true }));
      result.leftmost = [x, look().leftmost?.[0]];
      press("0");
    }

    const chart = by("contacts-chart"), box = chart.getBoundingClientRect();
    const pointer = (kind, x) => chart.dispatchEvent(
      new PointerEvent(kind, { clientX: x, clientY: box.top + 20, pointerId: 1, bubbles: true }));
    chart.setPointerCapture = () => {};  // there is no such pointer
    pointer("pointerdown", box.left + 46 + 0.37 * (box.width - 52));  // between the margins
    result.clickedInside = at();
    pointer("pointerdown", box.right - 7);
    result.clicked = at();
    pointer("pointermove", box.left + 47);
    Object.assign(result, { tip: by("tip").textContent, tipHidden: by("tip").hidden });
    pointer("pointerleave", 0);
    result.tipLeft = by("tip").hidden;

    const bodyBox = document.querySelector("#bodies input");
    const whole = look();
    if (bodyBox) {  // a page of one body has no list
      bodyBox.checked = false;
      bodyBox.dispatchEvent(new Event("change"));
      result.lessDrawn = whole.drawn - look().drawn;
      // The last body alone, as large as the view has room for.
      const boxes = [...document.querySelectorAll("#bodies input")];
      const check = (box, on) => { box.checked = on; box.dispatchEvent(new Event("change")); };
      boxes.forEach(box => check(box, false));
      check(boxes[boxes.length - 1], true);
      result.lastAlone = look().coarse;
      press("f");
      result.lastFitted = look().coarse;
      boxes.forEach(box => check(box, true));
      by("view").dispatchEvent(new MouseEvent("dblclick"));
      result.allFitted = look().coarse;
      press("0");
    }

    window.warmfront.seek(0);
    by("speed").value = "30";
    by("play").click();
    for (let i = 0; i < 400 && window.warmfront.playing && at() < 3; ++i) await frame();
    result.played = at();
    if (window.warmfront.playing) by("play").click();  // a slow browser may be at the end already
    result.paused = !window.warmfront.playing;
    result.pausedAt = at();

    result.ticks = [...document.querySelectorAll("#contacts-chart text[text-anchor=end]")].map(e => e.textContent);
    result.bars = document.querySelectorAll("#charts path.area").length;
    result.unnamed = [...document.querySelectorAll("button, input, select, canvas, svg")].filter(
      e => !(e.ariaLabel || e.getAttribute("aria-label") || e.labels?.length)).length;
    result.title = document.title;
    for (const id of ["subtitle", "legend", "shown", "foot"]) result[id] = by(id).innerText.replace(/\s+/g, " ").trim();
    result.captions = [...document.querySelectorAll("figcaption")].map(e => e.innerText.replace(/\s+/g, " ").trim());
    result.playable = !by("play").disabled;
    result.steps = scene.steps.length;
  } catch (error) {
    result.errors.push(String(error.stack));
  }
  fetch("/result", { method: "POST", body: JSON.stringify(result) });
})();
