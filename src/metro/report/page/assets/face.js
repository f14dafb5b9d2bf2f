// A face in space: heights over a raster or at points, turned with the mouse or the arrows.

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
  const width = 760, height = 420, heart = { x: 330, y: 195 }, scale = 215;
  const pen = drawing.getContext("2d");
  const density = Math.max(1, Math.min(3, window.devicePixelRatio || 1));
  drawing.width = width * density;
  drawing.height = height * density;
  pen.scale(density, density);
  const begin = { turn: -0.6, tilt: 0.75, tall: 0.3 };
  let view = { ...begin }, shown, layer = 0, points = [], seen = [], at = 0, read;
  const choice = html("span", { class: "choices" });

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
    at = 0;
    load();
  }

  function load() {
    const x = unpack(shown.x), y = unpack(shown.y), z = unpack(shown.layers[layer].z);
    const n = shown.columns;
    points = Array.from(z, (value, i) => ({ x: n ? x[i % n] : x[i], y: n ? y[Math.floor(i / n)] : y[i], z: value }));
    if (!Number.isFinite((points[at] || {}).z)) at = points.findIndex((p) => Number.isFinite(p.z));
    redraw();
  }

  function range(name) {
    const values = points.map((p) => p[name]).filter(Number.isFinite);
    return [Math.min(...values), Math.max(...values)];
  }

  function projection() {
    const [x0, x1] = range("x"), [y0, y1] = range("y");
    const size = Math.max(x1 - x0, y1 - y0) / 2 || 1;
    const { middle, limit } = shown.layers[layer];
    const [s, c] = [Math.sin(view.turn), Math.cos(view.turn)];
    const [st, ct] = [Math.sin(view.tilt), Math.cos(view.tilt)];
    return (p) => {
      const x = (p.x - (x0 + x1) / 2) / size, y = (p.y - (y0 + y1) / 2) / size;
      const z = ((p.z - middle) / limit) * view.tall, back = x * s + y * c;
      return { x: heart.x + scale * (x * c - y * s), y: heart.y - scale * (back * st + z * ct),
        far: back * ct - z * st };
    };
  }

  function redraw() {
    const project = projection(), n = shown.columns;
    const { middle, limit } = shown.layers[layer];
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
      pen.fillStyle = pen.strokeStyle = shade((z - middle) / limit);
      pen.beginPath();
      if (places.length === 1) pen.rect(seen[places[0]].x - 2.5, seen[places[0]].y - 2.5, 5, 5);
      else places.forEach((i, k) => pen[k ? "lineTo" : "moveTo"](seen[i].x, seen[i].y));
      pen.closePath();
      pen.fill();
      if (places.length > 1) { pen.lineWidth = 0.6; pen.stroke(); }
    }
    name(corners);
    bar(middle, limit);
    point();
  }

  // The plane in the middle of the colours with its corners: which way round the face is.
  function base(project) {
    const [x0, x1] = range("x"), [y0, y1] = range("y");
    const corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(([x, y]) => ({ x, y, ...project({ x, y, z: shown.layers[layer].middle }),
      told: `${fixed(x, 0)}, ${fixed(y, 0)}` }));
    pen.strokeStyle = "#888";
    pen.lineWidth = 1;
    pen.beginPath();
    corners.forEach((p, k) => pen[k ? "lineTo" : "moveTo"](p.x, p.y));
    pen.closePath();
    pen.stroke();
    return corners;
  }

  function name(corners) {
    pen.font = "12px sans-serif";
    pen.fillStyle = "#333";
    pen.textAlign = "left";
    pen.fillText("at the corners: x, y (mm)", 4, height - 8);
    for (const p of corners) {
      pen.textAlign = p.x < heart.x ? "right" : "left";
      pen.fillText(p.told, p.x + (p.x < heart.x ? -6 : 6), p.y + (p.y > heart.y ? 14 : -6));
    }
  }

  function bar(middle, limit) {
    const x = width - 80, top = 60, tall = 300, decimals = shown.layers[layer].decimals;
    for (let i = 0; i < tall; i += 1) {
      pen.fillStyle = shade(1 - (2 * i) / tall);
      pen.fillRect(x, top + i, 14, 1.5);
    }
    pen.fillStyle = "#333";
    pen.textAlign = "left";
    [1, 0.5, 0, -0.5, -1].forEach((s) =>
      pen.fillText(fixed(middle + s * limit, decimals), x + 19, top + ((1 - s) / 2) * tall + 4));
    pen.fillText(plot.unit, x, top - 12);
  }

  function point() {
    const p = seen[at], here = points[at];
    if (!p) return;
    pen.strokeStyle = "#000";
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(p.x, p.y, 6, 0, 2 * Math.PI);
    pen.stroke();
    const { told, decimals, name } = shown.layers[layer];
    if (read) read.textContent = `x ${fixed(here.x, 1)} mm, y ${fixed(here.y, 1)} mm: ${
      fixed(here.z, decimals)} ${plot.unit} (${name}; ${told} ${plot.unit})`;
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

  const above = () => look({ turn: 0, tilt: Math.PI / 2 });
  const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const others = { "+": () => change(0, 0, 1.25), "=": () => change(0, 0, 1.25), "-": () => change(0, 0, 0.8),
    Home: () => look(begin), t: above, T: above };
  drawing.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = keys[event.key], action = others[event.key];
    if (!way && !action) return;
    event.preventDefault();
    if (!way) action();
    else if (event.shiftKey) step(...way);
    else change(way[0] * 0.1, way[1] * 0.1);
  });

  drawing.addEventListener("pointerdown", (event) => drawing.setPointerCapture(event.pointerId));
  drawing.addEventListener("pointermove", (event) => {
    if (event.buttons) {
      change(event.movementX * 0.01, event.movementY * 0.01);
      return;
    }
    const area = drawing.getBoundingClientRect();
    const x = ((event.clientX - area.left) / area.width) * width;
    const y = ((event.clientY - area.top) / area.height) * height;
    const far = (p) => (p ? Math.hypot(p.x - x, p.y - y) : Infinity);
    const near = seen.reduce((best, p, i) => (far(p) < far(seen[best]) ? i : best), 0);
    if (far(seen[near]) > 15 || near === at) return;
    at = near;
    redraw();
  });

  const tools = [chooser(plot.keys, plot.curves, choose), choice, button("From above", above),
    button("From the side", () => look(begin)), button("Higher", () => change(0, 0, 1.25)),
    button("Flatter", () => change(0, 0, 0.8))];
  read = frame(host, plot, drawing, tools, html("span"));
  redraw();
}
