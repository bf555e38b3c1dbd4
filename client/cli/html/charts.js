// SPDX-License-Identifier: Apache-2.0
// The timeline: counts and times of each step as stacked areas, a cursor, and what a step was under the pointer.
const left = 46, right = 6, top_ = 6, bottom = 16;  // margins, in pixels
const number = x => x.toLocaleString("en", { maximumFractionDigits: x < 10 ? 3 : x < 100 ? 2 : 0 });

// 0 and one to three round numbers above it, of what is counted whole ones.
function niceMarks(most, whole) {
  const power = 10 ** Math.floor(Math.log10(most));
  const steps = [5, 2, 1, 0.5].map(s => s * power).filter(s => !whole || Number.isInteger(s));
  const step = steps.find(s => most / s >= 1.6) ?? (whole ? 1 : power / 2);
  return Array.from({ length: Math.floor(most / step + 1e-9) + 1 }, (_, i) => i * step).slice(0, 4);
}

function makeChart(id, series, seek, tip) {
  const svg = document.getElementById(id);
  const totals = scene.steps.map((_, i) => series.reduce((sum, s) => sum + s.values[i], 0));
  // A few steps far above the rest, such as the first, would leave the rest flat: the axis ends below them, which is marked.
  const sorted = [...totals].sort((a, b) => a - b);
  const usual = sorted[Math.floor(0.97 * (sorted.length - 1))];
  const highest = sorted[sorted.length - 1];
  const most = highest > 2.5 * usual && usual > 0 ? 1.15 * usual : highest || 1;
  const whole = totals.every(Number.isInteger);
  let width = 0, height = 0;
  const x = t => left + (width - left - right) * t / stepCount;
  const y = value => height - bottom - (height - bottom - top_) * Math.min(value, most) / most;

  function draw() {
    width = svg.clientWidth;
    height = svg.clientHeight;
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    let marks = "";
    for (const value of niceMarks(most, whole)) {
      marks += `<path class="grid" d="M${left} ${y(value)}H${width - right}"/>` +
               `<text x="${left - 5}" y="${y(value) + 3}" text-anchor="end">${number(value)}</text>`;
    }
    const every = Math.max(1, Math.ceil(stepCount / ((width - left) / 60)));
    for (let i = 0; i < stepCount; i += every)
      marks += `<text x="${x(i + 0.5)}" y="${height - 4}" text-anchor="middle">${scene.steps[i]}</text>`;
    const base = new Float64Array(stepCount);
    for (const s of series) {
      let over = "", under = "";
      for (let i = 0; i < stepCount; ++i) {
        under = `L${x(i + 1).toFixed(1)} ${y(base[i]).toFixed(1)}L${x(i).toFixed(1)} ${y(base[i]).toFixed(1)}` + under;
        base[i] += s.values[i];
        over += `L${x(i).toFixed(1)} ${y(base[i]).toFixed(1)}L${x(i + 1).toFixed(1)} ${y(base[i]).toFixed(1)}`;
      }
      // The lower side is gathered from the right; its steps are in the right order already.
      marks += `<path class="area ${s.name}" d="M${over.slice(1)}${under}Z"/>`;
    }
    totals.forEach((total, i) => {
      if (total > most) marks += `<path class="cut" d="M${x(i + 0.5)} ${top_ - 5}l4 6h-8z"><title>${number(total)}</title></path>`;
    });
    svg.innerHTML = marks + `<path class="cursor"/>`;
  }

  const timeAt = event => {
    const box = svg.getBoundingClientRect();
    return Math.min(stepCount, Math.max(0, (event.clientX - box.left - left) / (width - left - right) * stepCount));
  };
  svg.addEventListener("pointerdown", event => {
    svg.setPointerCapture(event.pointerId);
    seek(timeAt(event));
  });
  svg.addEventListener("pointermove", event => {
    if (event.buttons & 1) seek(timeAt(event));
    tip(svg, x, stepAt(timeAt(event)));
  });
  svg.addEventListener("pointerleave", () => tip(null));
  return {
    draw,
    cursor(t) {
      const at = states ? x(wholeIfState(t) + 0.5) : x(t);
      svg.querySelector(".cursor").setAttribute("d", `M${at.toFixed(1)} ${top_}V${height - bottom}`);
    },
  };
}

// What a step was, beside the pointer.
function showTip(svg, x, k) {
  const box = document.getElementById("tip");
  box.hidden = svg === null;
  if (!svg) return;
  box.innerHTML = `<b>frame ${scene.steps[k - 1]} </b><br>${asked.tip(k - 1)}`;
  const charts = document.getElementById("charts").getBoundingClientRect(), at = svg.getBoundingClientRect();
  const middle = at.left - charts.left + x(k - 0.5), half = box.offsetWidth / 2;
  box.style.left = `${Math.min(charts.width - half, Math.max(half, middle))}px`;
  box.style.top = `${at.top - charts.top}px`;
}
