// Saves what a plot shows: its numbers as CSV, its drawing as a picture.

const PAINTED = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray",
  "stroke-linecap", "font-size", "text-anchor", "display"];
const HEAD = 26, LINE = 20, LETTER = 7.2; // px of a picture's title and of a line of its legend; of a letter, about
const SHARPER = 2; // pixels of a picture per pixel of the page

function save(name, blob) {
  const link = html("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function filed(host, ...words) {
  const batch = host.closest("details.batch");
  return [batch ? batch.id.replace(/^batch-/, "") : "", ...words].join(" ").trim().replace(/[^\p{L}\p{N}]+/gu, "-");
}

// The decimals that numbers of a column have: they come in 65534 steps of its span.
function finest(column) {
  const [low, high] = ends(column.filter((value) => typeof value === "number"), 0);
  return Math.min(20, Math.max(0, -Math.ceil(Math.log10((high - low) / 65534))));
}

function cell(value, decimals) {
  if (typeof value === "number") return Number.isFinite(value) ? String(Number(value.toFixed(decimals))) : "";
  return /[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value;
}

function saveTable(name, heads, rows) {
  const decimals = heads.map((_, i) => finest(rows.map((row) => row[i])));
  const lines = [heads, ...rows].map((row) => row.map((value, i) => cell(value, decimals[i])).join(","));
  const text = lines.join("\n");
  save(`${name}.csv`, new Blob([`${text}\n`], { type: "text/csv" }));
}

// A copy of a drawing that needs no style sheet: what it is painted with becomes attributes.
function painted(drawing) {
  const copy = drawing.cloneNode(true), all = (root) => [root, ...root.querySelectorAll("*")];
  const originals = all(drawing);
  all(copy).forEach((one, i) => {
    const style = getComputedStyle(originals[i]);
    for (const name of PAINTED) one.setAttribute(name, style.getPropertyValue(name));
  });
  return copy;
}

// The entries of a legend, one after another, in as many lines as the width needs.
function entries(legend, width) {
  const group = svg("g");
  let x = 10, line = 0;
  for (const item of [...legend.children].filter((one) => !one.hidden)) {
    const swatch = item.querySelector("svg"), text = item.textContent.trim();
    const long = (swatch ? 34 : 0) + LETTER * text.length + 18;
    if (x + long > width && x > 10) [x, line] = [10, line + 1];
    const y = HEAD + LINE * line + 8;
    if (swatch) group.append(fill(painted(swatch), { x, y: y - 2, width: 26, height: 10 }));
    group.append(svg("text", { x: x + (swatch ? 34 : 0), y: y + 7, fill: getComputedStyle(legend).color }, text));
    x += long;
  }
  return { group, high: HEAD + LINE * (line + 1) + 6 };
}

function savePicture(name, title, drawing, legend) {
  const [, , width, tall] = drawing.getAttribute("viewBox").split(" ").map(Number);
  const said = entries(legend, width), high = tall + said.high, { color } = getComputedStyle(drawing);
  const whole = svg("svg", { xmlns: SVG, width: width * SHARPER, height: high * SHARPER, viewBox: `0 0 ${width} ${high}`,
    "font-family": "sans-serif", "font-size": 12 },
    svg("rect", { width, height: high, fill: getComputedStyle(document.documentElement).backgroundColor }),
    svg("text", { x: 10, y: 18, fill: color, "font-size": 14, "font-weight": "bold" }, title), said.group,
    fill(painted(drawing), { x: 0, y: said.high, width, height: tall }));
  const image = new Image(), canvas = html("canvas", { width: width * SHARPER, height: high * SHARPER });
  image.addEventListener("load", () => {
    canvas.getContext("2d").drawImage(image, 0, 0);
    canvas.toBlob((blob) => save(`${name}.png`, blob));
  });
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(whole))}`;
}
