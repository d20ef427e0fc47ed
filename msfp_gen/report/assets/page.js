// Connects the slider to the views of a bearing: the stack, its section, charts and numbers.
"use strict";

function addCharts(parent) {
  const kilo = 1e-3;
  const time = column((frame) => at("time", frame));
  const u = [0, 1].map((axis) => column((frame) => at("displacement", frame)[axis] * MILLI));
  const force = [0, 1].map((axis) => column((frame) => at("top_force", frame)[axis] * kilo));
  const peak = (values) => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const moving = [0, 1].filter((axis) => peak(u[axis]) > 0.02 * Math.max(peak(u[0]), peak(u[1])));
  const [names, colours] = [["u₁", "u₂"], ["#0072B2", "#D55E00"]];
  const add = (chart) => views.push(addChart(parent, chart, show));
  for (const axis of moving.length ? moving : [0]) {
    add({
      title: `Force and displacement along E${"₁₂"[axis]}`, xlabel: `${names[axis]} = ${report.sign.difference} [mm]`,
      ylabel: `force ${report.sign.force} F${"₁₂"[axis]} [kN]`, lines: [{ x: u[axis], y: force[axis], colour: colours[axis] }],
    });
  }
  if (moving.length === 2) {
    add({ title: "Orbit", xlabel: `u₁ = ${report.sign.difference} [mm]`, ylabel: `u₂ = ${report.sign.difference} [mm]`, equal: true, lines: [{ x: u[0], y: u[1], colour: "#009E73" }] });
  }
  const surfaces = (name, read) => surfaceNumbers.map((j) => ({
    name: `${name} ${j + 1}`, colour: colourOf(j), x: time, y: column((frame) => read(frame, j)),
  }));
  add({
    title: "Displacement", xlabel: "time t [s]", ylabel: `u = ${report.sign.difference} [mm]`, timed: true,
    lines: (moving.length ? moving : [0]).map((axis) => ({ name: names[axis], x: time, y: u[axis], colour: colours[axis] })),
  });
  add({
    title: "Sliding of every surface", xlabel: "time t [s]", ylabel: "sliding over capacity [%]", timed: true,
    lines: surfaces("surface", (frame, j) => (100 * at("sliding", frame)[j]) / report.surfaces[j].capacity),
    levels: [{ y: 100, name: "rim" }],
  });
  add({
    title: "Normal force of every surface", xlabel: "time t [s]", ylabel: "normal force N [kN]", timed: true,
    lines: surfaces("surface", (frame, j) => at("normal", frame)[j] * kilo),
  });
}

function addReadout() {
  const body = find("readout-surfaces");
  const rows = surfaceNumbers.map((j) => {
    const row = element(body, "tr");
    const head = element(row, "th", { scope: "row" });
    element(head, "span", { class: "swatch", style: `background: ${colourOf(j)}` });
    head.append(` ${j + 1}`);
    return [0, 1, 2, 3, 4].map(() => element(row, "td"));
  });
  views.push((frame) => {
    const [u, force] = [at("displacement", frame), at("top_force", frame)];
    const three = (values, scale) => [...values].map((value) => fixed(value * scale, 2)).join(", ");
    find("now-u").textContent = `${three(u, MILLI)} mm`;
    find("now-force").textContent = `${three(force, 1e-3)} kN`;
    rows.forEach((cells, j) => {
      const sliding = at("sliding", frame)[j];
      const texts = [
        report.states[at("state", frame)[j]], fixed(sliding * MILLI, 2), fixed((100 * sliding) / report.surfaces[j].capacity, 1),
        fixed(at("normal", frame)[j] * 1e-3, 2), fixed(100 * at("mobilised", frame)[j], 0),
      ];
      cells.forEach((cell, k) => { cell.textContent = texts[k]; });
    });
  });
}

function addSettings(scene) {
  find("scene-settings").hidden = !scene;
  if (!scene) return;
  views.push(scene.show);
  for (const name of ["open", "forces", "still"]) {
    find(name).addEventListener("change", (event) => {
      scene.settings[name] = event.target.checked;
      if (name === "still") scene.setView();
      scene.show(current);
    });
  }
  addViewButtons(scene);
}

function addEvents() {
  const list = find("frame-marks");
  const [start, end] = [at("time", 0), at("time", frameCount - 1)];
  for (const { time, surface, kind } of report.events) {
    if (kind === "rim release") continue;
    const share = (100 * (time - start)) / (end - start || 1);
    const colour = surface ? colourOf(surface - 1) : "currentColor";
    const title = surface ? `${kind}, surface ${surface}, t = ${fixed(time, 3)} s` : `${kind}, t = ${fixed(time, 3)} s`;
    element(list, "span", { style: `left: ${share}%; background: ${colour}`, title });
  }
}

find("frame").max = frameCount - 1;
addSettings(addScene(find("scene")));
views.push(addSection(find("section"), true), addSection(find("bearing"), false));
addCharts(find("charts"));
addReadout();
addPlayer();
addEvents();
show(report.peak);
document.documentElement.dataset.ready = "true";
