// SPDX-License-Identifier: GPL-3.0-or-later
// The slices of report.html: tabs, level slider and the value under the pointer. The page reads without it too.
"use strict";
for (const block of document.querySelectorAll(".slices")) {
  const nx = +block.dataset.nx, ny = +block.dataset.ny, nz = +block.dataset.nz;
  const panels = [...block.querySelectorAll(".panel")];
  const slider = block.querySelector("input[type=range]");
  const output = block.querySelector("output");
  let level = Math.floor(nz / 2);

  const show = (to) => {
    level = to;
    for (const large of block.querySelectorAll(".large"))
      large.style.setProperty("--at", 100 * level / Math.max(nz - 1, 1) + "%");
    if (!slider) return;
    slider.value = level;
    const height = slider.dataset.heights.split(",")[level];
    output.textContent = level + (height ? "  (" + height + ")" : "");
  };

  for (const tab of block.querySelectorAll(".tabs input"))
    tab.addEventListener("change", () => panels.forEach((panel) => { panel.hidden = panel.dataset.key !== tab.value; }));
  if (slider) slider.addEventListener("input", () => show(+slider.value));

  for (const panel of panels) {
    const every = Math.ceil(nz / Math.max(panel.querySelectorAll(".multiples .slice").length, 1));
    panel.querySelectorAll(".multiples .slice").forEach((small, index) =>
      small.addEventListener("click", () => show(index * every)));
    if (!panel.dataset.values) continue;
    const bytes = Uint8Array.from(atob(panel.dataset.values), (letter) => letter.charCodeAt(0));
    const values = new Float32Array(bytes.buffer);
    const readout = panel.querySelector(".readout");
    const large = panel.querySelector(".large");
    large.addEventListener("pointermove", (event) => {
      const box = large.getBoundingClientRect();
      const i = Math.min(nx - 1, Math.max(0, Math.floor((event.clientX - box.left) / box.width * nx)));
      const j = Math.min(ny - 1, Math.max(0, Math.floor((box.bottom - event.clientY) / box.height * ny)));
      const value = values[i + nx * (j + ny * level)];
      readout.textContent = "probe (" + i + ", " + j + ", " + level + "): " + value.toPrecision(4) + " " + panel.dataset.unit;
    });
    large.addEventListener("pointerleave", () => { readout.textContent = "\u00a0"; });
  }
  show(level);
}
