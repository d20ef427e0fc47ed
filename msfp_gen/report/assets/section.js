// The stack from the side, to scale, with the line of force and the friction circles. All points are projected into the
// plane of the section, which is exact for motion in that plane.
"use strict";

const MARGINS = { left: 58, right: 12, top: 12, bottom: 42 };
const WHOLE = { width: 420, height: 640, ...MARGINS };
const CLOSE = { width: 760, height: 330, ...MARGINS };
const MILLI = 1000;

const projected = (vector) => [vector[0] * horizontal[0] + vector[1] * horizontal[1], vector[2]];

// t_3 of a body, from its quaternion x, y, z, w.
function axisOf([x, y, z, w]) {
  return [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
}

// Ranges [mm] that contain the bodies in all frames and, if `whole`, the friction circles.
function extent(whole) {
  const x = [];
  const z = [];
  for (let frame = 0; frame < frameCount; frame += 1) {
    report.bodies.forEach((pieces, body) => {
      const reach = Math.max(...pieces.flatMap((piece) => piece.points.map(([r]) => r)));
      const height = Math.max(...pieces.flatMap((piece) => piece.points.map(([, h]) => h)));
      const [along, up] = projected(at("bottom", frame, body));
      x.push(along - reach, along + reach);
      z.push(up, up + height);
    });
    report.surfaces.forEach(({ circle }, surface) => {
      if (!whole) return;
      const [along, up] = projected(at("centre", frame, surface));
      x.push(along - circle, along + circle);
      z.push(up - circle, up + circle);
    });
  }
  const range = (values) => padded([values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))], 0.04);
  return [range(x).map((v) => v * MILLI), range(z).map((v) => v * MILLI)];
}

function bodyShape(group, pieces, scale, body) {
  const half = pieces.flatMap((piece) => piece.points);
  const mirrored = half.map(([r, h]) => [-r, h]).reverse();
  const path = (points) => points.map(([r, h]) => `${(r * scale).toFixed(2)},${(-h * scale).toFixed(2)}`).join(" ");
  element(group, "polygon", { class: `body tone${body % 2}`, points: path([...half, ...mirrored]) });
  for (const piece of pieces.filter(({ surface }) => surface)) {
    const face = [...piece.points.map(([r, h]) => [-r, h]).reverse(), ...piece.points];
    const ordered = face.sort((a, b) => a[0] - b[0]);
    element(group, "polyline", { class: "face", points: path(ordered), style: `stroke: ${colourOf(piece.surface - 1)}` });
  }
}

const colourOf = (surface) => report.surfaces[surface].colour;

function addSection(parent, whole) {
  const title = whole ? "Line of force and friction circles" : "Bearing from the side";
  const box = whole ? WHOLE : CLOSE;
  const { svg } = drawing(parent, title, box.width, box.height);
  const inner = [box.width - box.left - box.right, box.height - box.top - box.bottom];
  const [x, z] = withEqualScale(...extent(whole), ...inner);
  const degrees = fixed((report.azimuth * 180) / Math.PI, 0);
  const { px, py } = axes(svg, box, x, z, `along azimuth ${degrees}° from E₁ [mm]`, "height above the base [mm]");
  const scale = (px(1) - px(0)) * MILLI;
  element(element(svg, "clipPath", { id: `clip-${whole}` }), "rect", {
    x: box.left, y: box.top, width: inner[0], height: inner[1],
  });
  const content = element(svg, "g", { "clip-path": `url(#clip-${whole})` });
  const bodies = report.bodies.map((pieces, body) => {
    const group = element(content, "g", { class: "part" });
    bodyShape(group, pieces, scale, body);
    return group;
  });
  const marks = surfaceNumbers.map((surface) => {
    const style = `stroke: ${colourOf(surface)}`;
    return {
      circle: element(content, "circle", { class: "circle", style }),
      centre: element(content, "circle", { class: "centre", r: 2, style: `fill: ${colourOf(surface)}` }),
      line: element(content, "line", { class: "force" }),
    };
  });
  const screen = (vector) => {
    const [along, up] = projected(vector);
    return [px(along * MILLI), py(up * MILLI)];
  };
  return (frame) => {
    bodies.forEach((group, body) => {
      const [along, up] = projected(axisOf(at("turn", frame, body)));
      const tilt = (Math.atan2(along, up) * 180) / Math.PI;
      const [left, top] = screen(at("bottom", frame, body));
      group.setAttribute("transform", `translate(${left.toFixed(2)} ${top.toFixed(2)}) rotate(${tilt.toFixed(4)})`);
    });
    marks.forEach((mark, surface) => {
      const [cx, cy] = screen(at("centre", frame, surface));
      mark.circle.setAttribute("r", at("circle", frame)[surface] * scale);
      for (const circle of [mark.circle, mark.centre]) setAll(circle, { cx, cy });
      setAll(mark.line, lineThroughBox(screen(at("line", frame, surface)), projected(at("force", frame, surface)), box));
    });
  };
}

function setAll(node, attributes) {
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
}

// Ends of a line through a point of the drawing, from its lower to its upper edge; a point if the force is horizontal.
function lineThroughBox([left, top], [along, up], box) {
  if (!(Math.abs(up) > 0)) return { x1: 0, y1: 0, x2: 0, y2: 0 };
  const x = (y) => left - ((y - top) * along) / up;
  return { x1: x(box.height), y1: box.height, x2: x(0), y2: 0 };
}
