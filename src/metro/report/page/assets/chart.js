// Lines over one coordinate: a part of it can be seen larger, and the values under a movable line are read out.

const BOX = { left: 66, right: 14, top: 10, main: 266, between: 16, strip: 96, bottom: 44 };

function chart(host, plot) {
  const clip = `clip-${frames + 1}`;
  const ground = svg("g");
  const cursor = svg("g", { class: "cursor" });
  const picked = svg("rect", { class: "picked", y: BOX.top, width: 0 });
  const opening = svg("rect", { x: BOX.left, y: BOX.top });
  const drawing = svg("svg", { class: "chart" }, svg("clipPath", { id: clip }, opening), ground, picked, cursor);
  const [, across, unit = ""] = /^(.*?)(?: \((.*)\))?$/.exec(plot.x);
  const above = html("li", {}, "▲ goes on above: zoom in to see it");
  let curve, panels = [], from, to, at = 0, mark = null, tried = null, other = NO_OTHER;
  const partner = html("span", { class: "choices" });
  const around = frame(host, plot, drawing, resize);

  const inside = () => around.width() - BOX.left - BOX.right;
  const px = (x) => BOX.left + ((x - from) / (to - from)) * inside();
  const py = (panel) => (y) => panel.top + ((panel.high - y) / (panel.high - panel.low)) * panel.tall;
  const bottom = () => panels[panels.length - 1].top + panels[panels.length - 1].tall;
  const place = (event) => {
    const area = drawing.getBoundingClientRect();
    const scale = around.width() / area.width;
    const x = Math.min(Math.max((event.clientX - area.left) * scale, BOX.left), BOX.left + inside());
    return { x, y: (event.clientY - area.top) * scale, value: from + ((x - BOX.left) / inside()) * (to - from) };
  };

  function choose(next) {
    const before = curve && { ends: whole(), x: curve.x[at] };
    curve = { ...next, x: unpack(next.x), marks: [...(next.marks || []), ...(tried ? [tried] : [])], gaps: new Set(next.gaps || []) };
    curve.lines = next.lines.map((line) => ({ ...line, y: unpack(line.y),
      low: line.low && unpack(line.low), high: line.high && unpack(line.high) }));
    offer(next);
    const measure = curve.unit ?? plot.unit;
    const main = { ...next, lines: curve.lines, marks: curve.marks, label: next.label || plot.y, top: BOX.top, tall: BOX.main };
    const strip = { lines: rest(), label: `residual${measure ? ` (${measure})` : ""}`,
      top: BOX.top + BOX.main + BOX.between, tall: BOX.strip };
    panels = strip.lines.length ? [main, strip] : [main];
    mark = null;
    name();
    around.choose(next.said || "");
    const span = whole(), size = span[1] - span[0];
    // a curve over the same coordinate is seen as the one before was
    const same = before && span.every((end, i) => Math.abs(end - before.ends[i]) < 1e-3 * size);
    at = same ? nearest(curve.x, before.x) : Math.floor(curve.x.length / 2);
    if (!same) [from, to] = span;
    resize();
  }

  // Another run may be drawn beside this one; the choice stays as long as there is such a curve of that run.
  function offer(shown) {
    const runs = alike(plot, shown);
    partner.hidden = !runs.size;
    const { select, label } = labelled("compared with", [NO_OTHER, ...runs.keys()], (run) => {
      other = run;
      choose(shown);
      partner.querySelector("select").focus();
    });
    select.value = runs.has(other) ? other : NO_OTHER;
    partner.replaceChildren(label);
    if (runs.has(other)) curve.lines = [...curve.lines, besideLine(other, runs.get(other), curve)];
  }

  // Measured less predicted, over the interval of the measured value about zero; and less another run.
  function rest() {
    const [measured, ...predicted] = curve.lines;
    if (measured.look !== "measured" || !predicted.length || plot.log) return [];
    const half = measured.low && measured.low.map((low, i) => (measured.high[i] - low) / 2);
    const zero = { look: "zero", y: measured.y.map(() => 0), low: half && half.map((h) => -h), high: half };
    return [zero, ...predicted.map((line) => ({ ...line, y: measured.y.map((y, i) => y - line.y[i]) }))];
  }

  function whole() {
    if (curve.rows) return [0.5, curve.rows.length + 0.5];
    return ends([...curve.x, ...curve.marks.map((m) => m.x)], 0);
  }

  function all() {
    [from, to] = whole();
    redraw();
  }

  // The heights that a panel shows: of what is seen; the whole may have some of its own.
  function heights(panel) {
    const [first, last] = whole();
    if (panel.range && to - from > 0.999 * (last - first)) return panel.range;
    const lines = panel.lines.flatMap((line) => [line.y, line.low, line.high].filter(Boolean));
    const marks = (panel.marks || []).filter((m) => m.x >= from && m.x <= to).map((m) => m.y);
    const [low, high] = ends([...lines.flatMap((line) => [...line].filter((_, i) => reached(i))), ...marks], 0.05);
    return [panel.range ? panel.range[0] : low, high];
  }

  // Places that are seen, and those next to them, to which their lines go.
  const reached = (i) => (curve.x[i + 1] ?? Infinity) >= from && (curve.x[i - 1] ?? -Infinity) <= to;
  const seen = (i) => curve.x[i] >= from && curve.x[i] <= to;

  function name() {
    const swatch = (look) => svg("svg", { viewBox: "0 0 26 10", class: "swatch", "aria-hidden": "true" },
      ["stable", "chatter", "tried"].includes(look) || (curve.rows && look !== "band") ? symbol(look, 13, 5)
        : svg("path", { class: `line ${look}`, d: "M0 5H26" }));
    const entries = curve.lines.map((line) => [line.look, line.name]);
    if (curve.lines.some((line) => line.low)) entries.push(["band", "95 % interval"]);
    if (curve.marks.some((m) => m.look === "stable")) entries.push(["stable", "stable cut"]);
    if (curve.marks.some((m) => m.look === "chatter")) entries.push(["chatter", "chatter"]);
    if (tried) entries.push(["tried", "the cut that is tried"]);
    if ((curve.spans || []).length) entries.push(["span", "stable island"]);
    around.legend.replaceChildren(
      ...entries.map(([look, text]) => html("li", {}, swatch(look), ` ${text}`)), above);
  }

  function resize() {
    const width = around.width();
    fill(drawing, { viewBox: `0 0 ${width} ${bottom() + BOX.bottom}` });
    for (const each of [opening, picked]) fill(each, { height: bottom() - BOX.top });
    fill(opening, { width: inside() });
    redraw();
  }

  function redraw() {
    for (const panel of panels) [panel.low, panel.high] = heights(panel);
    const out = arrows(panels[0], curve, seen, panels[0].high, px, BOX.top);
    above.hidden = !out.length;
    ground.replaceChildren(...scale(), ...panels.flatMap(upright), ...out);
    point();
  }

  function scale() {
    const longest = curve.rows ? Math.max(...curve.rows.map((row) => row.length)) : 0;
    const along = curve.rows ? ticks(from, to, inside() / Math.max(30, 7 * longest), 1) : ticks(from, to, Math.min(8, inside() / 55));
    const told = (x) => (curve.rows ? curve.rows[Math.round(x) - 1] || "" : fixed(x, along.decimals));
    const lines = along.places.flatMap((x) => [
      ...panels.map((panel) => svg("path", { class: "grid", d: `M${px(x)} ${panel.top}v${panel.tall}` })),
      svg("text", { x: px(x), y: bottom() + 18, class: "middle" }, told(x))]);
    return [...lines,
      svg("text", { x: BOX.left + inside() / 2, y: bottom() + 38, class: "middle" }, plot.x)];
  }

  function upright(panel) {
    const y = py(panel), middle = panel.top + panel.tall / 2;
    const span = panel.high - panel.low;
    const up = ticks(panel.low, panel.high, Math.round(panel.tall / 36), plot.log && span > 2 ? 1 : 0);
    const told = (value) => (plot.log ? power(value, span > 2 ? 1 : 2) : fixed(value, up.decimals));
    const lines = up.places.flatMap((value) => [
      svg("path", { class: "grid", d: `M${BOX.left} ${y(value)}h${inside()}` }),
      svg("text", { x: BOX.left - 6, y: y(value) + 4, class: "end" }, told(value))]);
    const foot = svg("path", { class: "foot", d: `M${BOX.left} ${panel.top}v${panel.tall}h${inside()}` });
    return [...lines, foot, svg("text", { transform: `translate(13 ${middle}) rotate(-90)`, class: "middle" }, panel.label),
      drawn(panel, curve, px, y, clip)];
  }

  function value(y) {
    return plot.log ? power(y, 3) : fixed(y, curve.decimals);
  }

  function told() {
    if (mark !== null) return curve.marks[mark].told;
    if (curve.told) return curve.told[at];
    const measure = curve.unit ?? plot.unit, after = measure ? ` ${measure}` : "";
    const half = ({ low, high }) => {
      const size = low ? (high[at] - low[at]) / 2 : NaN;
      return Number.isFinite(size) ? ` ± ${fixed(size, curve.decimals)}` : "";
    };
    const lines = curve.lines.map((line) => `${line.name} ${value(line.y[at])}${half(line)}${after}`);
    const strip = panels[1] ? panels[1].lines.slice(1) : [];
    const [residuals, others] = [false, true].map((is) => strip.filter((line) => (line.look === "other") === is));
    const each = (line, named) => `${named ? `${line.name} ` : ""}${value(line.y[at])}${after}`;
    const said = [...(residuals.length ? [`residual: ${residuals.map((line) => each(line, residuals.length > 1)).join(", ")}`] : []),
      ...others.map((line) => `difference from ${other}: ${each(line, false)}`)];
    const step = ticks(from, to, 400).decimals;
    const where = curve.rows ? `${across} ${curve.rows[at]}` : `${across} ${fixed(curve.x[at], step)} ${unit}`;
    return `${where}: ${[...lines, ...said].join("; ")}`;
  }

  function point() {
    const x = mark === null ? curve.x[at] : curve.marks[mark].x;
    cursor.replaceChildren(svg("path", { d: `M${px(x)} ${BOX.top}V${bottom()}` }));
    const ring = (panel, y, r) => y >= panel.low && y <= panel.high
      && cursor.append(svg("circle", { cx: px(x), cy: py(panel)(y), r }));
    if (mark !== null) ring(panels[0], curve.marks[mark].y, 8);
    else for (const panel of panels) {
      for (const line of panel.lines) if (line.look !== "zero") ring(panel, line.y[at], 4);
    }
    cursor.style.display = x < from || x > to ? "none" : "";
    around.tell(told());
  }

  function see(first, last) {
    const [lowest, highest] = whole();
    const width = Math.min(highest - lowest, Math.max(last - first, (highest - lowest) / 500));
    from = Math.min(Math.max(lowest, (first + last - width) / 2), highest - width);
    to = from + width;
    redraw();
  }

  function zoom(factor) {
    const x = mark === null ? curve.x[at] : curve.marks[mark].x;
    const middle = Math.min(Math.max(x, from), to);
    see(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  function step(by) {
    mark = null;
    at = Math.min(Math.max(at + by, 0), curve.x.length - 1);
    const x = curve.x[at];
    if (x < from) see(x, x + to - from);
    else if (x > to) see(x - (to - from), x);
    else point();
  }

  function next(by) {
    if (!curve.marks.length) return;
    mark = mark === null ? 0 : (mark + by + curve.marks.length) % curve.marks.length;
    see(Math.min(from, curve.marks[mark].x), Math.max(to, curve.marks[mark].x));
  }

  const pan = (share) => see(from + share * (to - from), to + share * (to - from));
  const keys = { "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2), Home: all,
    End: () => step(curve.x.length), ArrowUp: () => next(1), ArrowDown: () => next(-1),
    PageUp: () => step(10), PageDown: () => step(-10) };
  drawing.addEventListener("keydown", (event) => {
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const action = sign ? () => (event.shiftKey ? pan(sign / 4) : step(sign)) : keys[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });

  function hover(here) {
    const near = curve.marks.findIndex((m) => Math.hypot(px(m.x) - here.x, py(panels[0])(m.y) - here.y) < 9);
    mark = near < 0 ? null : near;
    at = nearest(curve.x, here.value);
    point();
  }

  let start = null;
  drawing.addEventListener("pointerdown", (event) => {
    start = place(event);
    hover(start);
    drawing.setPointerCapture(event.pointerId); // a drag that ends beside the plot ends at its edge
  });
  drawing.addEventListener("pointermove", (event) => {
    const here = place(event);
    if (start) fill(picked, { x: Math.min(start.x, here.x), width: Math.abs(start.x - here.x) });
    else hover(here);
  });
  const release = (event) => {
    const here = place(event), first = start;
    start = null;
    fill(picked, { width: 0 });
    if (first && event.type === "pointerup" && Math.abs(here.x - first.x) > 5) {
      see(Math.min(first.value, here.value), Math.max(first.value, here.value));
    }
  };
  drawing.addEventListener("pointerup", release);
  drawing.addEventListener("pointercancel", release);
  drawing.addEventListener("dblclick", all);

  function table() {
    const ends = (line) => (line.low ? [line.low, line.high] : []);
    const columns = curve.lines.flatMap((line) => [line.y, ...ends(line)]);
    const heads = curve.lines.flatMap((line) => [line.name, ...ends(line).map((_, i) => `${line.name}, ${i ? "upper" : "lower"} 95 %`)]);
    const places = curve.rows || Array.from(curve.x);
    saveTable(saved(), [plot.x, ...heads], places.map((x, i) => [x, ...columns.map((column) => column[i])]));
  }
  const saved = () => filed(host, plot.title, curve.said || "");
  const titled = () => (curve.said ? `${plot.title}: ${curve.said}` : plot.title);
  around.tools.append(chooser(plot, choose), partner, button("Larger", () => zoom(0.5)),
    button("Smaller", () => zoom(2)), button("All", all), button("Save data", table),
    button("Save picture", () => savePicture(saved(), titled(), drawing, around.legend)));

  // Puts a mark that can be moved, and says what the first line is there.
  function put(x, y, words) {
    tried = { x, y, look: "tried", told: words };
    curve.marks = [...curve.marks.filter((one) => one.look !== "tried"), tried];
    panels[0].marks = curve.marks;
    mark = null;
    if (x < from || x > to) [from, to] = whole();
    name();
    redraw();
    const near = nearest(curve.x, x), { y: depth, low, high } = curve.lines[0];
    return { value: depth[near], low: low ? low[near] : depth[near], high: high ? high[near] : depth[near],
      told: curve.told[near], said: curve.said };
  }

  return { show: choose, put };
}
