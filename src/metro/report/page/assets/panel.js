// A panel of a chart: lines with their bands, gaps and marks over the coordinate that all panels share.

// Consecutive places of a curve that are known, parted where nothing was measured between.
function pieces(curve, known) {
  const found = [];
  let open = null;
  curve.x.forEach((_, i) => {
    if (curve.gaps.has(i) || !known(i)) open = null;
    if (!known(i)) return;
    if (!open) found.push((open = []));
    open.push(i);
  });
  return found;
}

function symbol(look, x, y) {
  if (look === "stable") return svg("circle", { class: "mark stable", cx: x, cy: y, r: 4 });
  if (look === "measured") return svg("circle", { class: "mark measured", cx: x, cy: y, r: 3.5 });
  if (look === "tried") return svg("path", { class: "mark tried", d: `M${x} ${y - 7}l7 7l-7 7l-7 -7z` });
  if (look === "other") return svg("path", { class: "mark other", d: `M${x} ${y - 5}l5 5l-5 5l-5 -5z` });
  if (look === "after") return svg("circle", { class: "mark after", cx: x, cy: y, r: 5 });
  return svg("path", { class: `mark ${look}`, d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8` });
}

// What is drawn of a panel; `px` places along the coordinate, `py` heights.
function drawn(panel, curve, px, py, clip) {
  const lines = svg("g", { "clip-path": `url(#${clip})` });
  const at = (values) => (i) => `${px(curve.x[i]).toFixed(1)} ${py(values[i]).toFixed(1)}`;
  for (const [x, y0, y1] of panel.spans || []) {
    lines.append(svg("path", { class: "line span", d: `M${px(x)} ${py(y0)}V${py(y1)}` }));
  }
  for (const line of panel.lines.filter((one) => one.low)) lines.append(svg("path", banded(line, curve, at, px)));
  for (const line of panel.lines) {
    if (curve.rows && line.look !== "zero") {
      line.y.forEach((y, i) => Number.isFinite(y) && lines.append(symbol(line.look, px(curve.x[i]), py(y))));
      continue;
    }
    const parts = pieces(curve, (i) => Number.isFinite(line.y[i]));
    // the end that goes nowhere lets a lone place be seen
    const d = parts.map((part) => `M${part.map(at(line.y)).join("L")}h0`).join("");
    lines.append(svg("path", { class: `line ${line.look}`, d }));
  }
  for (const m of panel.marks || []) lines.append(symbol(m.look, px(m.x), py(m.y)));
  return lines;
}

// A band over a coordinate; over places of a table a bar at each.
function banded(line, curve, at, px) {
  const parts = pieces(curve, (i) => Number.isFinite(line.low[i] + line.high[i]));
  if (curve.rows) {
    const bar = (i) => `M${at(line.low)(i)}L${at(line.high)(i)}M${at(line.low)(i)}m-4 0h8M${at(line.high)(i)}m-4 0h8`;
    return { class: "bar", d: parts.flat().map(bar).join("") };
  }
  const round = (part) => `M${part.map(at(line.low)).join("L")}L${[...part].reverse().map(at(line.high)).join("L")}Z`;
  return { class: "area", d: parts.map(round).join("") };
}

// An arrow at the highest place of every piece of a line that leaves the panel above.
function arrows(panel, curve, seen, high, px, top) {
  return panel.lines.flatMap((line) => pieces(curve, (i) => seen(i) && line.y[i] > high).map((part) => {
    const highest = part.reduce((best, i) => (line.y[i] > line.y[best] ? i : best));
    return svg("path", { class: `beyond ${line.look}`, d: `M${px(curve.x[highest])} ${top + 1}l5 9h-10z` });
  }));
}
