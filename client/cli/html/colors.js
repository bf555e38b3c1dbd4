// SPDX-License-Identifier: Apache-2.0
// Colours of the picture, as [r, g, b] in [0, 1]; those of the charts are in style.css.
const dark = matchMedia("(prefers-color-scheme: dark)");
const rgb = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16) / 255);

// From early to late, or from touching to far: crimson, amber, yellow. Nothing else on the page is warm and saturated.
const ramp = ["#b0124d", "#e8590c", "#f7c325"].map(rgb);
function rampColor(value) {
  const x = 2 * Math.min(1, Math.max(0, value)), i = Math.min(1, Math.floor(x));
  return ramp[i].map((c, axis) => c + (ramp[i + 1][axis] - c) * (x - i));
}

// Bodies: pale on light ground, deep on dark ground, none of them near the ramp.
const pale = ["#b4c3d4", "#cfc8bb", "#aecabc", "#c6bcd6", "#b9d0d6", "#c8cdb0", "#bfc2c9", "#a9b8cf"].map(rgb);
const deep = ["#5f7389", "#7a7264", "#57796a", "#71658a", "#5c7f88", "#727a58", "#6b6f78", "#536787"].map(rgb);
const bodyColor = b => (dark.matches ? deep : pale)[b % pale.length];
const groundColor = () => rgb(dark.matches ? "#16181c" : "#fbfbfa");
const edgeColor = () => (dark.matches ? [0, 0, 0, 0.45] : [0.15, 0.2, 0.28, 0.22]);
// Edges and points of no face have their body's colour times the first, plus the second: thin things, at 3:1 and more to the ground.
const loneStrength = () => (dark.matches ? [0.7, 0.3] : [0.55, 0]);
const loneColor = b => bodyColor(b).map(c => loneStrength()[0] * c + loneStrength()[1]);
const css = color => `rgb(${color.map(c => Math.round(255 * c)).join(" ")})`;
