// A face in space: heights over a raster or at points, turned with the mouse, a finger or the arrows.

// Blue over white to red (ColorBrewer's RdBu), which every common kind of colour vision tells apart.
const SHADES = [[5, 48, 97], [67, 147, 195], [247, 247, 247], [214, 96, 77], [103, 0, 31]];

function shade(share) {
  const place = Math.min(Math.max((share + 1) / 2, 0), 1) * (SHADES.length - 1);
  const below = Math.min(Math.floor(place), SHADES.length - 2);
  const mix = SHADES[below].map((c, i) => Math.round(c + (place - below) * (SHADES[below + 1][i] - c)));
  return `rgb(${mix.join(" ")})`;
}

function face(host, plot) {
  const drawing = html("canvas", { class: "face" });
  const pen = drawing.getContext("2d");
  const density = Math.max(1, Math.min(3, window.devicePixelRatio || 1));
  let view = { turn: 0, tilt: 0, tall: 0 }, alone = false, shown, layer = 0, points = [], seen = [], at = 0;
  let width, height, heart, scale;
  const choice = html("span", { class: "choices" });
  const around = frame(host, plot, drawing, () => { size(); redraw(); });

  function size() {
    width = around.width();
    scale = Math.min(215, 0.32 * (width - 90));
    height = Math.round(1.72 * scale + 70);
    heart = { x: (width - 90) / 2, y: (height - 20) / 2 };
    fill(drawing, { width: Math.round(width * density), height: Math.round(height * density) });
    pen.setTransform(density, 0, 0, density, 0, 0);
  }

  function choose(next) {
    shown = next;
    layer = Math.min(layer, next.layers.length - 1);
    choice.replaceChildren();
    if (next.layers.length > 1) {
      const names = next.layers.map((one) => one.name);
      const { select, label } = labelled("drawn", names, (name) => { layer = names.indexOf(name); load(); });
      select.value = names[layer];
      choice.append(label);
    }
    load();
  }

  function load() {
    const x = unpack(shown.x), y = unpack(shown.y), z = unpack(shown.layers[layer].z);
    const n = shown.columns, before = points[at];
    points = Array.from(z, (value, i) => ({ x: n ? x[i % n] : x[i], y: n ? y[Math.floor(i / n)] : y[i], z: value }));
    // the ring stays where it was, as far as the face goes
    const far = (p) => (!Number.isFinite(p.z) ? Infinity : before ? Math.hypot(p.x - before.x, p.y - before.y) : 0);
    at = points.reduce((best, p, i) => (far(p) < far(points[best]) ? i : best), 0);
    around.choose(`${shown.said}, ${shown.layers[layer].name}`);
    redraw();
  }

  const range = (name) => ends(points.map((p) => p[name]), 0);
  const limit = () => (alone ? shown.layers[layer].limit : plot.limit);
  const half = () => Math.max(...["x", "y"].map((name) => range(name)[1] - range(name)[0])) / 2;
  // How many times larger than the lengths the heights are drawn.
  const exaggeration = () => (view.tall * half()) / (limit() * plot.mm);

  function projection() {
    const [x0, x1] = range("x"), [y0, y1] = range("y"), extent = half();
    const { middle } = shown.layers[layer];
    const [s, c] = [Math.sin(view.turn), Math.cos(view.turn)];
    const [st, ct] = [Math.sin(view.tilt), Math.cos(view.tilt)];
    return (p) => {
      const x = (p.x - (x0 + x1) / 2) / extent, y = (p.y - (y0 + y1) / 2) / extent;
      const z = ((p.z - middle) / limit()) * view.tall, back = x * s + y * c;
      return { x: heart.x + scale * (x * c - y * s), y: heart.y - scale * (back * st + z * ct),
        far: back * ct - z * st };
    };
  }

  function redraw() {
    const project = projection(), n = shown.columns;
    const { middle } = shown.layers[layer], end = limit();
    seen = points.map((p) => (Number.isFinite(p.z) ? project(p) : null));
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, width, height);
    const corners = base(project);
    const pieces = [];
    const add = (places) => {
      if (places.some((i) => !seen[i])) return;
      const mean = (f) => places.reduce((sum, i) => sum + f(i), 0) / places.length;
      pieces.push({ places, far: mean((i) => seen[i].far), z: mean((i) => points[i].z) });
    };
    points.forEach((_, i) => {
      if (!n) add([i]);
      else if (i % n < n - 1 && i + n < points.length) add([i, i + 1, i + n + 1, i + n]);
    });
    pieces.sort((a, b) => b.far - a.far);
    for (const { places, z } of pieces) {
      pen.fillStyle = pen.strokeStyle = shade((z - middle) / end);
      pen.beginPath();
      if (places.length === 1) pen.rect(seen[places[0]].x - 2.5, seen[places[0]].y - 2.5, 5, 5);
      else places.forEach((i, k) => pen[k ? "lineTo" : "moveTo"](seen[i].x, seen[i].y));
      pen.closePath();
      pen.fill();
      if (places.length > 1) { pen.lineWidth = 0.6; pen.stroke(); }
    }
    name(corners);
    bar(middle, end);
    point();
  }

  // The plane in the middle of the colours with its corners: which way round the face is.
  function base(project) {
    const [x0, x1] = range("x"), [y0, y1] = range("y"), z = shown.layers[layer].middle;
    const corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(
      ([x, y]) => ({ ...project({ x, y, z }), told: `${fixed(x, 0)}, ${fixed(y, 0)}` }));
    pen.strokeStyle = "#888";
    pen.lineWidth = 1;
    pen.beginPath();
    corners.forEach((p, k) => pen[k ? "lineTo" : "moveTo"](p.x, p.y));
    pen.closePath();
    pen.stroke();
    return corners;
  }

  function write(text, x, y) {
    pen.font = "12px sans-serif";
    pen.strokeStyle = "#fff";
    pen.lineWidth = 4;
    pen.lineJoin = "round";
    pen.strokeText(text, x, y);
    pen.fillStyle = "#333";
    pen.fillText(text, x, y);
  }

  function name(corners) {
    pen.textAlign = "left";
    write("at the corners: x, y (mm)", 4, height - 22);
    write(`heights × ${Number(exaggeration().toPrecision(2))}`, 4, height - 6);
    pen.textAlign = "center";
    for (const p of corners) {
      const [dx, dy] = [p.x - heart.x, p.y - heart.y], away = Math.hypot(dx, dy) || 1;
      const room = pen.measureText(p.told).width / 2 + 2;
      write(p.told, Math.min(Math.max(p.x + (dx / away) * (room + 8), room), width - 90 - room),
        Math.min(Math.max(p.y + (dy / away) * 18 + 4, 12), height - 4));
    }
  }

  function bar(middle, end) {
    const x = width - 76, top = 34, tall = height - 96, decimals = shown.layers[layer].decimals;
    for (let i = 0; i < tall; i += 1) {
      pen.fillStyle = shade(1 - (2 * i) / tall);
      pen.fillRect(x, top + i, 14, 1.5);
    }
    pen.textAlign = "left";
    [1, 0.5, 0, -0.5, -1].forEach((s) =>
      write(fixed(middle + s * end, decimals), x + 19, top + ((1 - s) / 2) * tall + 4));
    write(plot.unit, x, top - 12);
    write("beyond:", x, top + tall + 24);
    write("darkest", x, top + tall + 39);
  }

  function point() {
    const p = seen[at], here = points[at];
    if (!p) return;
    pen.strokeStyle = "#000";
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(p.x, p.y, 6, 0, 2 * Math.PI);
    pen.stroke();
    const { told, decimals } = shown.layers[layer];
    around.tell(`x ${fixed(here.x, 1)} mm, y ${fixed(here.y, 1)} mm: ${fixed(here.z, decimals)} ${
      plot.unit}; all of it ${told} ${plot.unit}`);
  }

  function change(turn, tilt, tall = 1) {
    view = { turn: view.turn + turn, tilt: Math.min(Math.max(view.tilt + tilt, 0.05), Math.PI / 2),
      tall: Math.min(Math.max(view.tall * tall, 0.02), 1.2) };
    redraw();
  }

  function look(next) {
    view = { ...view, ...next };
    redraw();
  }

  // To the nearest place in a direction; at points of a path along it, or to those beside it.
  function step(dx, dy) {
    const here = points[at];
    let best = -1, least = Infinity;
    points.forEach((p, i) => {
      const along = (p.x - here.x) * dx + (p.y - here.y) * dy;
      const aside = Math.abs((p.x - here.x) * dy - (p.y - here.y) * dx);
      if (along > 1e-9 && aside <= along && Number.isFinite(p.z) && along + 2 * aside < least) {
        [best, least] = [i, along + 2 * aside];
      }
    });
    if (best >= 0) at = best;
    redraw();
  }

  function highest() {
    at = points.reduce((best, p, i) => (p.z > points[best].z ? i : best), at);
    redraw();
  }

  function scaled(toggle) {
    alone = !alone;
    fill(toggle, { "aria-pressed": String(alone) });
    redraw();
  }

  // The first view: a deep edge stays in it.
  function back() {
    const { middle } = shown.layers[layer];
    const deepest = Math.max(...ends(points.map((p) => p.z), 0).map((z) => Math.abs(z - middle))) / limit();
    look({ turn: -0.6, tilt: 0.75, tall: Math.min(0.3, 0.7 / deepest) });
  }

  const above = () => look({ turn: 0, tilt: Math.PI / 2 });
  const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const others = { "+": () => change(0, 0, 1.25), "=": () => change(0, 0, 1.25), "-": () => change(0, 0, 0.8),
    Home: back, End: highest, t: above, T: above };
  drawing.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = keys[event.key], action = others[event.key];
    if (!way && !action) return;
    event.preventDefault();
    if (!way) action();
    else if (event.shiftKey) step(...way);
    else change(way[0] * 0.1, way[1] * 0.1);
  });

  // To the place under the pointer, where there is one near it.
  function pick(event) {
    const area = drawing.getBoundingClientRect(), ratio = width / area.width;
    const x = (event.clientX - area.left) * ratio, y = (event.clientY - area.top) * ratio;
    const far = (p) => (p ? Math.hypot(p.x - x, p.y - y) : Infinity);
    const near = seen.reduce((best, p, i) => (far(p) < far(seen[best]) ? i : best), 0);
    if (far(seen[near]) > 15 || near === at) return;
    at = near;
    redraw();
  }

  let held = null; // where the pointer was last while it turns the face
  drawing.addEventListener("pointerdown", (event) => {
    pick(event);
    held = { x: event.clientX, y: event.clientY };
    drawing.setPointerCapture(event.pointerId);
  });
  drawing.addEventListener("pointermove", (event) => {
    if (!held) {
      pick(event);
      return;
    }
    change((event.clientX - held.x) * 0.01, (event.clientY - held.y) * 0.01);
    held = { x: event.clientX, y: event.clientY };
  });
  for (const end of ["pointerup", "pointercancel"]) drawing.addEventListener(end, () => { held = null; });

  const saved = () => filed(host, plot.title, shown.said, shown.layers[layer].name);
  function table() {
    saveTable(saved(), ["x (mm)", "y (mm)", `height (${plot.unit})`], points.map(({ x, y, z }) => [x, y, z]));
  }

  size();
  const toggle = fill(button("Scale to this face", scaled), { "aria-pressed": "false" });
  around.tools.append(chooser(plot, choose), choice, button("From above", above),
    button("Start view", back), button("Higher", () => change(0, 0, 1.25)),
    button("Flatter", () => change(0, 0, 0.8)), toggle, button("Save data", table),
    button("Save picture", () => drawing.toBlob((blob) => save(`${saved()}.png`, blob))));
  back();
}
