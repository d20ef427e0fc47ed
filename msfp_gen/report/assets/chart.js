// A chart in SVG: lines, dashed levels, and a cursor at the current frame.
"use strict";

const CHART = { width: 460, height: 270, left: 58, right: 12, top: 12, bottom: 42 };

function ticks(low, high, count = 5) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return { values: found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

function padded(values, share = 0.06) {
  let low = Math.min(...values);
  let high = Math.max(...values);
  if (high - low < 1e-12) [low, high] = [low - 1, high + 1];
  return [low - share * (high - low), high + share * (high - low)];
}

// Widens one of two ranges so that both have the same scale in a box of this width and height.
function withEqualScale(x, y, width, height) {
  const scale = Math.max((x[1] - x[0]) / width, (y[1] - y[0]) / height);
  const widened = ([low, high], size) => [(low + high - scale * size) / 2, (low + high + scale * size) / 2];
  return [widened(x, width), widened(y, height)];
}

// Draws axes, grid and labels of a chart; returns the functions px, py from values to positions in the drawing.
function axes(svg, box, x, y, xlabel, ylabel) {
  const px = (value) => box.left + ((value - x[0]) / (x[1] - x[0])) * (box.width - box.left - box.right);
  const py = (value) => box.height - box.bottom - ((value - y[0]) / (y[1] - y[0])) * (box.height - box.top - box.bottom);
  const bottom = box.height - box.bottom;
  const along = ticks(...x, Math.round((box.width - box.left - box.right) / 70));
  for (const value of along.values) {
    element(svg, "line", { class: "grid", x1: px(value), x2: px(value), y1: box.top, y2: bottom });
    element(svg, "text", { x: px(value), y: bottom + 16, "text-anchor": "middle" }, fixed(value, along.digits));
  }
  const up = ticks(...y, Math.round((box.height - box.top - box.bottom) / 45));
  for (const value of up.values) {
    element(svg, "line", { class: "grid", x1: box.left, x2: box.width - box.right, y1: py(value), y2: py(value) });
    element(svg, "text", { x: box.left - 6, y: py(value) + 4, "text-anchor": "end" }, fixed(value, up.digits));
  }
  const middle = (box.left + box.width - box.right) / 2;
  element(svg, "text", { class: "label", x: middle, y: box.height - 6, "text-anchor": "middle" }, xlabel);
  const centre = (box.top + bottom) / 2;
  const turn = `rotate(-90 13 ${centre})`;
  element(svg, "text", { class: "label", x: 13, y: centre, "text-anchor": "middle", transform: turn }, ylabel);
  return { px, py };
}

function drawing(parent, title, width, height) {
  const figure = element(parent, "figure", { class: "chart" });
  element(figure, "figcaption", {}, title);
  const svg = element(figure, "svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": title });
  return { figure, svg };
}

// chart: { title, xlabel, ylabel, lines: [{ x, y, colour, name }], levels: [{ y, name }], timed, equal }. A click calls
// `goTo` with a frame: that of the time clicked if x is time (`timed`), else that of the nearest point of the first line.
// Returns a function that moves the cursor to a frame.
function addChart(parent, chart, goTo) {
  const { figure, svg } = drawing(parent, chart.title, CHART.width, CHART.height);
  const levels = chart.levels ?? [];
  let x = padded(chart.lines.flatMap((line) => line.x), chart.timed ? 0 : 0.06);
  let y = padded([...chart.lines.flatMap((line) => line.y), ...levels.map((level) => level.y)]);
  const inner = [CHART.width - CHART.left - CHART.right, CHART.height - CHART.top - CHART.bottom];
  if (chart.equal) [x, y] = withEqualScale(x, y, ...inner);
  const { px, py } = axes(svg, CHART, x, y, chart.xlabel, chart.ylabel);
  for (const level of levels) {
    element(svg, "line", { class: "level", x1: px(x[0]), x2: px(x[1]), y1: py(level.y), y2: py(level.y) });
    element(svg, "text", { x: px(x[1]) - 3, y: py(level.y) - 4, "text-anchor": "end" }, level.name);
  }
  for (const line of chart.lines) {
    const points = line.x.map((value, i) => `${px(value).toFixed(1)},${py(line.y[i]).toFixed(1)}`).join(" ");
    element(svg, "polyline", { class: "line", points, style: `stroke: ${line.colour}` });
  }
  legend(figure, chart.lines.filter((line) => line.name));
  const bar = chart.timed ? element(svg, "line", { class: "cursor", y1: CHART.top, y2: CHART.height - CHART.bottom }) : null;
  const dots = chart.lines.map((line) => element(svg, "circle", { class: "dot", r: 4.5, style: `fill: ${line.colour}` }));
  svg.addEventListener("pointerdown", (event) => {
    const [line] = chart.lines;
    const clicked = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const distance = (i) => Math.hypot(px(line.x[i]) - clicked.x, chart.timed ? 0 : py(line.y[i]) - clicked.y);
    goTo(line.x.reduce((best, _, i) => (distance(i) < distance(best) ? i : best), 0));
  });
  return (frame) => {
    chart.lines.forEach((line, index) => {
      dots[index].setAttribute("cx", px(line.x[frame]));
      dots[index].setAttribute("cy", py(line.y[frame]));
    });
    for (const end of bar ? ["x1", "x2"] : []) bar.setAttribute(end, px(chart.lines[0].x[frame]));
  };
}

function legend(figure, lines) {
  if (!lines.length) return;
  const list = element(figure, "ul", { class: "legend" });
  for (const line of lines) {
    const entry = element(list, "li");
    element(entry, "span", { class: "swatch", style: `background: ${line.colour}` });
    entry.append(line.name);
  }
}
