// Lines over one coordinate: a part of it can be seen larger, and the values under a movable line are read out.

const BOX = { width: 760, height: 320, left: 66, right: 14, top: 10, bottom: 44 };

function chart(host, plot) {
  const inside = { x: BOX.width - BOX.left - BOX.right, y: BOX.height - BOX.top - BOX.bottom };
  const clip = `clip-${frames + 1}`;
  const ground = svg("g");
  const cursor = svg("g", { class: "cursor" });
  const picked = svg("rect", { class: "picked", y: BOX.top, height: inside.y, width: 0 });
  const drawing = svg("svg", { viewBox: `0 0 ${BOX.width} ${BOX.height}`, class: "chart" },
    svg("clipPath", { id: clip }, svg("rect", { x: BOX.left, y: BOX.top, width: inside.x, height: inside.y })),
    ground, picked, cursor);
  const [, across, unit = ""] = /^(.*?)(?: \((.*)\))?$/.exec(plot.x);
  const legend = html("ul", { class: "legend" });
  let curve, from, to, low, high, at, mark, read;

  const px = (x) => BOX.left + ((x - from) / (to - from)) * inside.x;
  const py = (y) => BOX.top + ((high - y) / (high - low)) * inside.y;
  const place = (event) => {
    const area = drawing.getBoundingClientRect();
    const x = ((event.clientX - area.left) / area.width) * BOX.width;
    const y = ((event.clientY - area.top) / area.height) * BOX.height;
    return { x, y, value: from + ((x - BOX.left) / inside.x) * (to - from) };
  };

  function choose(next) {
    curve = { ...next, x: unpack(next.x), marks: next.marks || [], spans: next.spans || [] };
    curve.lines = next.lines.map((line) => ({ ...line, y: unpack(line.y),
      low: line.low && unpack(line.low), high: line.high && unpack(line.high) }));
    at = Math.floor(curve.x.length / 2);
    mark = null;
    name();
    all();
  }

  function all() {
    [from, to] = ends([...curve.x, ...curve.marks.map((m) => m.x)], 0);
    redraw();
  }

  function ends(values, margin) {
    const known = values.filter(Number.isFinite);
    let first = known.length ? Math.min(...known) : 0;
    let last = known.length ? Math.max(...known) : 1;
    if (first === last) [first, last] = [first - 1, last + 1];
    return [first - margin * (last - first), last + margin * (last - first)];
  }

  function heights() {
    if (curve.range) return curve.range;
    const seen = (_, i) => curve.x[i] >= from && curve.x[i] <= to;
    const lines = curve.lines.flatMap((line) => [line.y, line.low, line.high].filter(Boolean));
    return ends(lines.flatMap((line) => [...line].filter(seen)), 0.05);
  }

  function name() {
    const swatch = (look) => svg("svg", { viewBox: "0 0 26 10", class: "swatch", "aria-hidden": "true" },
      look === "stable" || look === "chatter" ? symbol(look, 13, 5)
        : svg("path", { class: `line ${look}`, d: "M0 5H26" }));
    const entries = curve.lines.map((line) => [line.look, line.name]);
    if (curve.lines.some((line) => line.low)) entries.push(["band", "95 % interval"]);
    if (curve.marks.some((m) => m.look === "stable")) entries.push(["stable", "stable cut"]);
    if (curve.marks.some((m) => m.look === "chatter")) entries.push(["chatter", "chatter"]);
    if (curve.spans.length) entries.push(["span", "stable island"]);
    legend.replaceChildren(...entries.map(([look, text]) => html("li", {}, swatch(look), ` ${text}`)));
  }

  function symbol(look, x, y) {
    return look === "stable" ? svg("circle", { class: "mark stable", cx: x, cy: y, r: 4 })
      : svg("path", { class: "mark chatter", d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8` });
  }

  function path(y) {
    let pen = "M", d = "";
    y.forEach((value, i) => {
      if (!Number.isFinite(value)) { pen = "M"; return; }
      d += `${pen}${px(curve.x[i]).toFixed(1)} ${py(value).toFixed(1)}`;
      pen = "L";
    });
    return d;
  }

  function band(line) {
    const known = [...line.low.keys()].filter((i) => Number.isFinite(line.low[i] + line.high[i]));
    const point = (values) => (i) => `${px(curve.x[i]).toFixed(1)} ${py(values[i]).toFixed(1)}`;
    return known.length ? `M${known.map(point(line.low)).join("L")}L${
      known.reverse().map(point(line.high)).join("L")}Z` : "";
  }

  function redraw() {
    [low, high] = heights();
    const parts = [];
    const along = ticks(from, to, 8);
    const up = ticks(low, high, 6);
    for (const x of along.places) {
      parts.push(svg("path", { class: "grid", d: `M${px(x)} ${BOX.top}v${inside.y}` }),
        svg("text", { x: px(x), y: BOX.height - 26, class: "middle" }, fixed(x, along.decimals)));
    }
    for (const y of up.places) {
      parts.push(svg("path", { class: "grid", d: `M${BOX.left} ${py(y)}h${inside.x}` }),
        svg("text", { x: BOX.left - 6, y: py(y) + 4, class: "end" }, fixed(y, up.decimals)));
    }
    parts.push(svg("text", { x: BOX.left + inside.x / 2, y: BOX.height - 6, class: "middle" }, plot.x),
      svg("text", { transform: `translate(13 ${BOX.top + inside.y / 2}) rotate(-90)`, class: "middle" }, plot.y));
    const lines = svg("g", { "clip-path": `url(#${clip})` });
    for (const [x, y0, y1] of curve.spans) {
      lines.append(svg("path", { class: "line span", d: `M${px(x)} ${py(y0)}V${py(y1)}` }));
    }
    for (const line of curve.lines.filter((one) => one.low)) {
      lines.append(svg("path", { class: "band", d: band(line) }));
    }
    for (const line of curve.lines) {
      lines.append(svg("path", { class: `line ${line.look}`, d: path(line.y) }));
      if (curve.x.length <= 60 && line.look === "measured") {
        line.y.forEach((y, i) => Number.isFinite(y) && lines.append(
          svg("circle", { class: "dot", cx: px(curve.x[i]), cy: py(y), r: 2 })));
      }
    }
    for (const m of curve.marks) lines.append(symbol(m.look, px(m.x), py(m.y)));
    ground.replaceChildren(...parts, lines);
    point();
  }

  function told() {
    if (mark !== null) return curve.marks[mark].told;
    if (curve.told) return curve.told[at];
    const value = (line) => {
      const half = line.low ? (line.high[at] - line.low[at]) / 2 : NaN;
      const give = Number.isFinite(half) ? ` ± ${fixed(half, curve.decimals)}` : "";
      return `${line.name} ${fixed(line.y[at], curve.decimals)}${give}${plot.unit ? ` ${plot.unit}` : ""}`;
    };
    const step = ticks(from, to, 400).decimals;
    return `${across} ${fixed(curve.x[at], step)} ${unit}: ${curve.lines.map(value).join("; ")}`;
  }

  function point() {
    const x = mark === null ? curve.x[at] : curve.marks[mark].x;
    cursor.replaceChildren(svg("path", { d: `M${px(x)} ${BOX.top}v${inside.y}` }));
    if (mark !== null) cursor.append(svg("circle", { cx: px(x), cy: py(curve.marks[mark].y), r: 8 }));
    else for (const line of curve.lines) {
      if (Number.isFinite(line.y[at])) cursor.append(svg("circle", { cx: px(x), cy: py(line.y[at]), r: 4 }));
    }
    cursor.style.display = x < from || x > to ? "none" : "";
    if (read) read.textContent = told();
  }

  function see(first, last) {
    const [lowest, highest] = ends([...curve.x, ...curve.marks.map((m) => m.x)], 0);
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
    ArrowUp: () => next(1), ArrowDown: () => next(-1),
    PageUp: () => step(10), PageDown: () => step(-10) };
  drawing.addEventListener("keydown", (event) => {
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const action = sign ? () => (event.shiftKey ? pan(sign / 4) : step(sign)) : keys[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });

  let start = null;
  drawing.addEventListener("pointerdown", (event) => { start = place(event); });
  drawing.addEventListener("pointermove", (event) => {
    const here = place(event);
    if (start && event.buttons) {
      fill(picked, { x: Math.min(start.x, here.x), width: Math.abs(start.x - here.x) }, []);
      return;
    }
    const near = curve.marks.findIndex((m) => Math.hypot(px(m.x) - here.x, py(m.y) - here.y) < 9);
    mark = near < 0 ? null : near;
    at = nearest(curve.x, here.value);
    point();
  });
  const release = (event) => {
    const here = place(event);
    if (start && event.type === "pointerup" && Math.abs(here.x - start.x) > 5) {
      see(Math.min(start.value, here.value), Math.max(start.value, here.value));
    }
    start = null;
    fill(picked, { width: 0 }, []);
  };
  drawing.addEventListener("pointerup", release);
  drawing.addEventListener("pointerleave", release);
  drawing.addEventListener("dblclick", all);

  const tools = [chooser(plot.keys, plot.curves, choose), button("Larger", () => zoom(0.5)),
    button("Smaller", () => zoom(2)), button("All", all)];
  read = frame(host, plot, drawing, tools, legend);
  point();
}
