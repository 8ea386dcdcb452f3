#include "apps/report/view_script.hpp"

namespace talus {

const char* const view_script = R"js((function () {
"use strict";
const box = document.currentScript.parentNode, data = JSON.parse(box.querySelector(".grains").textContent);
const bytes = Uint8Array.from(atob(data.grains), c => c.charCodeAt(0)), record = 8 + data.colours.length;
const view = new DataView(bytes.buffer), n = bytes.length / record;
const X = new Float32Array(n), Y = new Float32Array(n), Z = new Float32Array(n), R = new Float32Array(n);
for (let k = 0; k < n; ++k) {
  const at = j => view.getUint16(k * record + 2 * j, true) / 65535;
  X[k] = at(0) - data.size[0] / 2; Y[k] = at(1) - data.size[1] / 2; Z[k] = at(2) - data.size[2] / 2; R[k] = at(3);
}
const canvas = box.querySelector("canvas"), pen = canvas.getContext("2d"), choice = box.querySelector("select");
const scale = box.querySelector(".scale"), still = box.parentNode.querySelector("svg");
let azimuth = data.azimuth, elevation = data.elevation, zoom = 1, sprites = [];
function sprite(rgb) {
  const side = 64, s = document.createElement("canvas"), p = s.getContext("2d"), r = side / 2;
  s.width = s.height = side;
  const tone = (f, w) => "rgb(" + rgb.map(c => Math.round(Math.min(255, c * f + w))).join(",") + ")";
  const g = p.createRadialGradient(0.68 * r, 0.6 * r, 0.05 * r, r, r, r);
  g.addColorStop(0, tone(1.05, 46)); g.addColorStop(0.45, tone(0.95, 0));
  g.addColorStop(0.85, tone(0.62, 0)); g.addColorStop(1, tone(0.4, 0));
  p.fillStyle = g; p.beginPath(); p.arc(r, r, r - 1, 0, 2 * Math.PI); p.fill();
  return s;
}
function choose() {
  const of = data.colours[choice.selectedIndex];
  sprites = of.palette.map(sprite);
  scale.textContent = of.text;
  scale.previousElementSibling.style.background = of.materials ? "none" :
    "linear-gradient(to right," + of.palette.map(c => "rgb(" + c.join(",") + ")").join(",") + ")";
}
function draw() {
  const width = canvas.clientWidth, height = Math.round(0.8 * width), dots = Math.min(2, window.devicePixelRatio || 1);
  if (!width) return;
  canvas.width = width * dots; canvas.height = height * dots;
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  pen.clearRect(0, 0, width, height);
  const a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180, ca = Math.cos(a), sa = Math.sin(a),
        ce = Math.cos(e), se = Math.sin(e);
  const reach = Math.hypot(data.size[0], data.size[1]), tall = data.size[2] * ce + reach * Math.abs(se);
  const f = zoom * Math.min(0.94 * width / Math.max(reach, 1e-9), 0.94 * height / Math.max(tall, 1e-9));
  const right = (x, y) => width / 2 + f * (-sa * x + ca * y);
  const down = (x, y, z) => height / 2 - f * (-se * ca * x - se * sa * y + ce * z);
  const near = (x, y, z) => ce * ca * x + ce * sa * y + se * z;
  const lines = front => {
    pen.strokeStyle = front ? "rgba(70,80,92,0.55)" : "rgba(70,80,92,0.9)"; pen.lineWidth = 1; pen.beginPath();
    for (const l of data.walls.concat(data.bends)) {
      if (l.length > 6 && near(l[6], l[7], l[8]) * near(l[9], l[10], l[11]) >= 0) continue;
      const m = near((l[0] + l[3]) / 2, (l[1] + l[4]) / 2, (l[2] + l[5]) / 2);
      if ((m > 0) !== front) continue;
      pen.moveTo(right(l[0], l[1]), down(l[0], l[1], l[2])); pen.lineTo(right(l[3], l[4]), down(l[3], l[4], l[5]));
    }
    pen.stroke();
  };
  lines(false);
  const depth = new Float32Array(n), order = new Uint32Array(n), last = sprites.length - 1;
  for (let k = 0; k < n; ++k) { depth[k] = near(X[k], Y[k], Z[k]); order[k] = k; }
  order.sort((i, j) => depth[i] - depth[j]);
  const column = 8 + choice.selectedIndex, materials = data.colours[choice.selectedIndex].materials;
  for (const k of order) {
    const r = R[k] * f, value = bytes[k * record + column];
    const s = sprites[materials ? value % (last + 1) : Math.round(value / 255 * last)];
    pen.drawImage(s, right(X[k], Y[k]) - r, down(X[k], Y[k], Z[k]) - r, 2 * r, 2 * r);
  }
  lines(true);
}
let waiting = false;
function soon() { if (!waiting) { waiting = true; requestAnimationFrame(() => { waiting = false; draw(); }); } }
function turn(da, de) { azimuth += da; elevation = Math.max(-90, Math.min(90, elevation + de)); soon(); }
let from = null;
canvas.addEventListener("pointerdown", e => { from = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
canvas.addEventListener("pointermove", e => {
  if (!from) return;
  turn(-0.4 * (e.clientX - from[0]), 0.4 * (e.clientY - from[1])); from = [e.clientX, e.clientY];
});
for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { from = null; });
canvas.addEventListener("keydown", e => {
  const by = { ArrowLeft: [-6, 0], ArrowRight: [6, 0], ArrowUp: [0, 6], ArrowDown: [0, -6] }[e.key];
  if (by) { turn(by[0], by[1]); e.preventDefault(); }
  if (e.key === "+" || e.key === "-") { zoom = Math.max(0.5, Math.min(8, zoom * (e.key === "+" ? 1.2 : 1 / 1.2))); soon(); }
});
for (const of of data.colours) choice.add(new Option(of.name));
choice.addEventListener("change", () => { choose(); soon(); });
window.addEventListener("resize", soon);
choose(); box.hidden = false; if (still) still.style.display = "none"; draw();
}());)js";

}  // namespace talus
