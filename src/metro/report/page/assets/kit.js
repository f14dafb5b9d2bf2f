"use strict";
// What all plots share: making elements, unpacking numbers, writing numbers, choosing among curves.

const SVG = "http://www.w3.org/2000/svg";

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

function html(name, attributes = {}, ...children) {
  return fill(document.createElement(name), attributes, children);
}

function svg(name, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, name), attributes, children);
}

// Numbers come as 16-bit steps between low and high, in base64; the last code says that there is none.
function unpack(packed) {
  const bytes = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 2 }, (_, i) => {
    const code = view.getUint16(2 * i, true);
    return code === 65535 ? NaN : packed.low + (code / 65534) * (packed.high - packed.low);
  });
}

function minus(text) {
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

// Negative decimals round to tens, hundreds, … as the report does.
function fixed(value, decimals) {
  if (!Number.isFinite(value)) return "–";
  const step = 10 ** -decimals;
  return minus((decimals < 0 ? Math.round(value / step) * step : value).toFixed(Math.max(0, decimals)));
}

// Round places between two ends: 1, 2 or 5 times a power of ten apart; with the decimals that they need.
function ticks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.max(0, Math.floor(high / step + 1e-9) - first + 1);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return { places: Array.from({ length: count }, (_, i) => (first + i) * step), decimals };
}

function nearest(values, place) {
  let best = 0;
  values.forEach((value, i) => {
    if (Math.abs(value - place) < Math.abs(values[best] - place)) best = i;
  });
  return best;
}

function button(text, action) {
  const made = html("button", { type: "button" }, text);
  made.addEventListener("click", action);
  return made;
}

function labelled(name, options, chosen) {
  const select = html("select", {}, ...options.map((text) => html("option", { value: text }, text)));
  select.addEventListener("change", () => chosen(select.value));
  return { select, label: html("label", {}, `${name} `, select) };
}

// One choice for each part of a curve's key that varies; a later one offers what the earlier ones leave.
function chooser(names, curves, chosen) {
  const host = html("span", { class: "choices" });
  const key = [...curves[0].key];
  function build() {
    const had = host.contains(document.activeElement)
      ? [...host.querySelectorAll("select")].findIndex((s) => s === document.activeElement) : -1;
    host.replaceChildren();
    let left = curves;
    names.forEach((name, i) => {
      const options = [...new Set(left.map((curve) => curve.key[i]))];
      if (!options.includes(key[i])) key[i] = options[0];
      if (new Set(curves.map((curve) => curve.key[i])).size > 1) {
        const { select, label } = labelled(name, options, (value) => { key[i] = value; build(); });
        select.value = key[i];
        host.append(label);
      }
      left = left.filter((curve) => curve.key[i] === key[i]);
    });
    if (had >= 0) host.querySelectorAll("select")[had].focus();
    chosen(left[0]);
  }
  build();
  return host;
}

let frames = 0;

// What every plot stands in: title, choices, the drawing, what is read there, and how to go about it.
function frame(host, plot, drawing, tools, legend) {
  const id = `plot-${(frames += 1)}`;
  const read = html("output", { "aria-live": "polite" });
  const help = html("details", { class: "help" }, html("summary", {}, "Keys and mouse"),
    html("p", { id: `${id}-help` }, plot.help));
  fill(drawing, { tabindex: "0", role: "application", "aria-label": plot.title,
    "aria-describedby": `${id}-help` }, []);
  host.append(fill(html("figure", { class: "plot", id, "aria-label": plot.title }), {}, [
    html("h4", {}, plot.title), html("div", { class: "tools" }, ...tools), legend, drawing, read,
    ...(plot.note ? [html("p", { class: "note" }, plot.note)] : []), help]));
  return read;
}
