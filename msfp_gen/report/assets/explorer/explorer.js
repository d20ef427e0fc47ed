// The page: controls, requests to the worker, and what is drawn of the answer.
"use strict";

const explorer = JSON.parse(document.getElementById("explorer-data").textContent);
const find = (id) => document.getElementById(id);
const RANGE = { friction: [0, 2.5], radius: [0.6, 1.6], load: [0.1, 3], amplitude: [0.02, 1.5], rate: [0.2, 5] };
const MOST_POINTS = 3000; // of a line in a chart
const state = { index: 0, settings: null, sent: 0, shown: 0, busy: false, waiting: false, last: null, row: null };

const problemAt = (index) => explorer.problems[index];
const nominalOf = (problem, name) => problem.surfaces.map((row) => row[problem.values.indexOf(name)]);

// Coefficients at the pivot, as a data sheet has them, of those at the surfaces, and the reverse: `friction_at_pivot` and
// `friction_from_pivot` of the package. `change(own, inner, step, k)` gives the moment and the result of surface k.
function alongChains({ pivot }, radius, change) {
  const found = radius.map(() => 0);
  for (const chain of pivot.chains) {
    let arm = 0, moment = 0;
    for (const k of chain) {
      const next = radius[k] - pivot.heights[k];
      [moment, found[k]] = change(k, moment, next - arm);
      arm = next;
    }
  }
  return found;
}

const atPivot = (problem, friction, radius) => alongChains(problem, radius, (k, inner, step) => [friction[k] * radius[k], (friction[k] * radius[k] - inner) / step]);
const fromPivot = (problem, sheet, radius) => alongChains(problem, radius, (k, inner, step) => {
  const moment = Math.max(0, inner + sheet[k] * step);
  return [moment, moment / radius[k]];
});

function nominalSettings(problem) {
  return { friction: nominalOf(problem, "friction"), radius: nominalOf(problem, "radius"), load: 1, amplitude: 1, rate: 1, angle: 0 };
}

// One slider with its number, which may be typed; `write` sets the value in the settings. The number is `factor` times the
// value, in `unit`, with so many `digits`; a number beyond the slider becomes its nearest end.
function addSlider(parent, { name, low, high, value, factor = 1, unit, digits, write }) {
  const row = element(parent, "div", { class: "control" });
  const id = `slider-${parent.children.length}`;
  element(row, "label", { for: id }, name);
  const input = element(row, "input", { id, type: "range", min: low, max: high, step: "any", value, "data-name": name });
  const number = element(row, "input", { type: "number", step: "any", "aria-label": `${name} [${unit}]`, "data-number": name });
  element(row, "span", {}, unit);
  input.value = value;
  const set = (v) => {
    write(v);
    number.value = (v * factor).toFixed(digits);
  };
  set(value);
  input.addEventListener("input", () => {
    set(Number(input.value));
    request();
  });
  number.addEventListener("change", () => {
    const typed = number.value === "" ? Number(input.value) : Number(number.value) / factor;
    const v = Math.min(high, Math.max(low, typed));
    input.value = v;
    set(v);
    request();
  });
}

function addControls() {
  const problem = problemAt(state.index);
  const { settings } = state;
  const panel = find("controls");
  panel.replaceChildren();
  const ranged = (value, [low, high]) => ({ low: low * value, high: high * value, value });
  // A scene whose friction was given at the pivot keeps it there, whatever its radii.
  const sheet = problem.pivot && atPivot(problem, settings.friction, settings.radius);
  const changed = (list, k, v) => {
    if (list[k] === v) return;
    list[k] = v;
    if (sheet) settings.friction = fromPivot(problem, sheet, settings.radius);
  };
  (sheet ?? settings.friction).forEach((value, k) => addSlider(panel, {
    name: sheet ? `friction ${k + 1} at the pivot` : `friction of surface ${k + 1}`, ...ranged(value || 0.05, RANGE.friction), value,
    factor: 100, unit: "%", digits: 2, write: (v) => changed(sheet ?? settings.friction, k, v),
  }));
  settings.radius.forEach((value, k) => addSlider(panel, {
    name: `radius of surface ${k + 1}`, ...ranged(value, RANGE.radius),
    factor: 1000, unit: "mm", digits: 0, write: (v) => changed(settings.radius, k, v),
  }));
  if (problem.axialLoad !== null) addSlider(panel, {
    name: "axial load", ...ranged(1, RANGE.load), factor: problem.axialLoad / 1000, unit: "kN", digits: 0,
    write: (v) => { settings.load = v; },
  });
  addSlider(panel, {
    name: problem.record ? "scale of the record" : "amplitude", ...ranged(1, RANGE.amplitude),
    ...(problem.record ? { unit: "×", digits: 2 } : { factor: 1000 * problem.amplitude, unit: "mm", digits: 1 }),
    write: (v) => { settings.amplitude = v; },
  });
  if (!problem.record) addSlider(panel, {
    name: problem.period ? "frequency" : "speed", ...ranged(1, RANGE.rate),
    ...(problem.period ? { factor: 1 / problem.period, unit: "Hz", digits: 4 } : { unit: "×", digits: 2 }),
    write: (v) => { settings.rate = v; },
  });
  if (!problem.planar) addSlider(panel, {
    name: "direction", low: -90, high: 90, value: 0, unit: "°", digits: 0,
    write: (v) => { settings.angle = (v * Math.PI) / 180; },
  });
}

// At most one run at a time: while one is under way, the latest settings wait.
function request() {
  if (state.busy) {
    state.waiting = true;
    return;
  }
  state.busy = true;
  state.sent += 1;
  worker.postMessage({ request: performance.now(), index: state.index, settings: state.settings });
}

function answered({ data }) {
  if (data.ready) {
    choose(0);
    return;
  }
  if (data.prepared !== undefined) {
    find("status").textContent = `starting: model ${data.prepared} of ${explorer.modules.length} is ready`;
    find("progress").value = data.prepared / explorer.modules.length;
    return;
  }
  if (data.progress !== undefined) {
    find("progress").hidden = false;
    find("progress").value = data.progress;
    return;
  }
  state.busy = false;
  find("progress").hidden = true;
  if (data.index === state.index) {
    if (data.failure) fail(data.failure);
    else show(data);
  }
  if (state.waiting) {
    state.waiting = false;
    request();
  }
}

function fail(text) {
  find("status").textContent = `failed: ${text}`;
  find("status").className = "status failed";
}

function choose(index) {
  state.index = index;
  state.settings = nominalSettings(problemAt(index));
  state.row = null;
  addControls();
  request();
}

const cell = (row, name, text) => element(row, name, name === "th" ? { scope: "row" } : {}, text);

function table(parent, rows) {
  parent.replaceChildren();
  for (const [name, text] of rows) {
    const row = element(parent, "tr");
    cell(row, "th", name);
    cell(row, "td", text);
  }
}

const stride = (count) => Math.max(1, Math.ceil(count / MOST_POINTS));
const thinned = (values) => values.filter((_, i) => i % stride(values.length) === 0);

// Shows the instant of a point of a chart.
function goTo(point) {
  state.row = point * stride(state.last.numbers.at.count);
  find("row").value = state.row;
  section();
}

function show({ found, settings, request: begun, cost }) {
  const problem = problemAt(state.index);
  const numbers = numbersOf(problem, found, settings.angle);
  const words = { ok: "", stopped: "stopped" }, word = words[found.status] ?? "failed";
  const end = { stopped: "the run met its stop condition", failed: `the run ended with ${found.status}` }[word];
  find("status").textContent = word ? `${end} at ${fixed(found.reached, 3)} s` : "";
  find("status").className = `status ${word}`;
  const { factor, difference, force } = problem.sign;
  const kilo = numbers.force.map((v) => (factor * v) / 1000);
  const milli = numbers.path.map((v) => factor * v * 1000);
  const blue = problem.colours[0];
  find("loop").replaceChildren();
  const markers = [addChart(find("loop"), {
    title: "Hysteresis loop", xlabel: `displacement u = ${difference} [mm]`, ylabel: `force ${force} [kN]`,
    lines: [{ x: thinned(milli), y: thinned(kilo), colour: blue }],
  }, goTo)];
  find("orbit").replaceChildren();
  find("orbit").hidden = problem.planar;
  if (!problem.planar) markers.push(addChart(find("orbit"), {
    title: "Orbit in plan", xlabel: `u₁ = ${difference} [mm]`, ylabel: `u₂ = ${difference} [mm]`, equal: true,
    lines: [{ x: thinned(numbers.u.map((v) => factor * v[0] * 1000)), y: thinned(numbers.u.map((v) => factor * v[1] * 1000)), colour: blue }],
  }, goTo));
  const { cycle } = numbers;
  const weight = problem.axialLoad === null ? null : problem.axialLoad * settings.load;
  const last = problem.planar ? "last cycle" : "last cycle, in the direction";
  table(find("numbers"), [
    ["largest displacement", `${fixed(1000 * numbers.peakDisplacement[3], 2)} mm`],
    ["largest horizontal force", `${fixed(numbers.peakForce[3] / 1000, 3)} kN`],
    ...(weight === null ? [] : [["over the axial load", fixed(numbers.peakForce[3] / weight, 4)]]),
    [`effective stiffness, ${last}`, cycle ? `${fixed(cycle.stiffness / 1e6, 4)} kN/mm` : (problem.record ? "not defined for a record" : "no closed cycle")],
    [`effective damping, ${last}`, cycle && cycle.damping !== null ? `${fixed(100 * cycle.damping, 2)} %` : "–"],
    ["energy dissipated in it", cycle ? `${fixed(cycle.energy / 1000, 4)} kJ` : "–"],
    ["least normal force", `${fixed(Math.min(...numbers.leastNormal) / 1000, 2)} kN`],
  ]);
  table(find("surfaces"), numbers.sliding.map((slid, k) => {
    const capacity = problem.surfaces[k][problem.values.indexOf("capacity")];
    const rim = numbers.gap[k] <= 0 ? ", rim met" : "";
    return [`surface ${k + 1}`, `${fixed(1000 * slid, 2)} mm, ${fixed((100 * slid) / capacity, 0)} % of capacity${rim}`];
  }));
  find("regime-table").hidden = !numbers.straight;
  if (numbers.straight) table(find("regimes"), regimes(problem, numbers).slice(0, 12).map(({ set, from }) => [`from ${fixed(1000 * from, 1)} mm`, set]));
  state.last = { problem, found, settings, numbers, markers };
  find("row").max = numbers.at.count - 1;
  find("row").value = state.row ?? numbers.peak;
  section();
  state.shown += 1;
  state.times = { run: cost, redraw: performance.now() - begun };
  find("cost").textContent = `${fixed(cost, 0)} ms run, ${fixed(state.times.redraw, 0)} ms in all`;
}

function section() {
  const { problem, settings, numbers, markers } = state.last;
  const row = Math.min(Number(find("row").value), numbers.at.count - 1);
  for (const mark of markers) mark(Math.floor(row / stride(numbers.at.count)));
  drawStack(find("section"), problem, numbers, settings.radius, settings.angle, row);
  find("instant").textContent = `t = ${fixed(numbers.at.read("time", row)[0], 3)} s, u = ${fixed(1000 * numbers.path[row], 2)} mm`;
}

const worker = new Worker(URL.createObjectURL(new Blob([find("worker").textContent], { type: "text/javascript" })));
worker.onmessage = answered;
worker.onerror = (event) => fail(event.message);
explorer.problems.forEach(({ title }, index) => element(find("preset"), "option", { value: index }, title));
find("preset").addEventListener("change", () => choose(Number(find("preset").value)));
find("reset").addEventListener("click", () => choose(state.index));
find("row").addEventListener("input", () => {
  state.row = Number(find("row").value);
  section();
});
worker.postMessage({
  problems: explorer.problems,
  modules: explorer.modules.map((text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0))),
});
