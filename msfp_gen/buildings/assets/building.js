// Connects the slider to the views of a building: the frame, charts and numbers of its bearings.
"use strict";

const SHADES = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];
const DRAWN = 24; // bearings whose axial forces are drawn in the chart, at most
const shade = (index) => SHADES[index % SHADES.length];

function addCharts(parent) {
  const time = column((frame) => at("time", frame));
  const u = [0, 1].map((axis) => column((frame) => at("mean", frame)[axis] * MILLI));
  const shear = [0, 1].map((axis) => column((frame) => at("shear", frame)[axis] * 1e-6));
  const add = (chart) => views.push(addChart(parent, chart, show));
  for (const axis of [0, 1]) {
    add({
      title: `Base shear and displacement along E${"₁₂"[axis]}`, xlabel: `mean u${"₁₂"[axis]} = ${report.sign.difference} [mm]`,
      ylabel: `base shear V${"₁₂"[axis]} [MN]`, lines: [{ x: u[axis], y: shear[axis], colour: shade(axis) }],
    });
  }
  add({ title: "Orbit, mean of the bearings", xlabel: `u₁ = ${report.sign.difference} [mm]`, ylabel: `u₂ = ${report.sign.difference} [mm]`, equal: true, lines: [{ x: u[0], y: u[1], colour: shade(2) }] });
  for (const axis of [0, 1]) {
    const floors = report.nodes.map(({ name }, node) => ({ name, colour: shade(node), x: time, y: column((frame) => at("acceleration", frame, node)[axis]) }));
    add({ title: `Floor accelerations along E${"₁₂"[axis]} at ${report.plates ? "centres of mass" : "nodes"}`, xlabel: "time t [s]", ylabel: "acceleration [m/s²]", timed: true, lines: floors.reverse() });
  }
  if (report.storeys.length) {
    const drifts = report.storeys.map((name, storey) => ({ name, colour: shade(storey), x: time, y: column((frame) => 100 * at("drift", frame)[storey]) }));
    add({ title: "Storey drifts at stiffness centres", xlabel: "time t [s]", ylabel: "drift over height [%]", timed: true, lines: drifts });
  }
  const loads = report.places.slice(0, DRAWN).map((_, index) => ({ colour: shade(index), x: time, y: column((frame) => at("ratio", frame)[index]) }));
  add({ title: "Axial force of every bearing", xlabel: "time t [s]", ylabel: "N over N at rest [-]", timed: true, lines: loads, levels: [{ y: 0, name: "uplift" }] });
}

function addReadout() {
  const body = find("readout-bearings");
  const rows = report.labels.map((label) => {
    const row = element(body, "tr");
    const head = element(row, "th", { scope: "row" });
    const swatch = element(head, "span", { class: "swatch" });
    head.append(label);
    return { swatch, cells: [0, 1, 2, 3, 4].map(() => element(row, "td")) };
  });
  views.push((frame) => {
    const shear = [...at("shear", frame)].map((value) => fixed(value * 1e-6, 3)).join(", ");
    find("now-shear").textContent = `${shear} MN`;
    rows.forEach(({ swatch, cells }, index) => {
      const top = at("top", frame, index);
      const ratio = at("ratio", frame)[index];
      swatch.style.background = loadColour(ratio);
      const texts = [
        fixed(-top[0] * MILLI, 1), fixed(-top[1] * MILLI, 1), fixed(ratio * report.loads[index] * 1e-3, 0),
        ratio > 0 ? fixed(ratio, 2) : "0 (lifts)",
        `${fixed(at("left", frame)[index] * MILLI, 1)} of ${at("left_surface", frame)[index]}`,
      ];
      cells.forEach((cell, k) => { cell.textContent = texts[k]; });
    });
  });
}

function addSettings(scene) {
  find("scene-settings").hidden = !scene;
  if (!scene) return;
  views.push(scene.show);
  find("still").addEventListener("change", (event) => {
    scene.settings.still = event.target.checked;
    scene.show(current);
  });
  find("scale").addEventListener("change", (event) => {
    scene.settings.scale = Number(event.target.value);
    scene.show(current);
  });
  addViewButtons(scene);
}

find("frame").max = frameCount - 1;
addSettings(addFrame(find("scene")));
addCharts(find("charts"));
addReadout();
addPlayer();
show(report.peak);
document.documentElement.dataset.ready = "true";
