"use strict";
// What all plots share: making elements, unpacking numbers, writing numbers, choosing among curves.

const SVG = "http://www.w3.org/2000/svg";
const WIDEST = 760; // a drawing is as wide as its place, and scaled up where that is wider

function fill(element, attributes, children = []) {
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
  if (!packed.data) return packed; // computed in the page
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

// A number given by its decadic logarithm, to so many digits: 3.16·10⁻⁷, 10⁻⁷ where that is all.
function power(logarithm, digits) {
  if (!Number.isFinite(logarithm)) return "–";
  const [share, exponent] = (10 ** logarithm).toExponential(digits - 1).split("e");
  const raised = [...String(Number(exponent))].map((sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign])).join("");
  return `${share === "1" ? "" : `${share}·`}10${raised}`;
}

// Round places between two ends: 1, 2 or 5 times a power of ten apart; with the decimals that they need.
function ticks(low, high, most, least = 0) {
  const rough = Math.max(least, (high - low) / most);
  const scale = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * scale).find((size) => size >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.max(0, Math.floor(high / step + 1e-9) - first + 1);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return { places: Array.from({ length: count }, (_, i) => (first + i) * step), decimals };
}

// The least and the greatest of the values that are known, and a share of their span beside them.
function ends(values, margin) {
  const known = values.filter(Number.isFinite);
  let first = known.reduce((a, b) => Math.min(a, b), Infinity);
  let last = known.reduce((a, b) => Math.max(a, b), -Infinity);
  if (!known.length) [first, last] = [0, 1];
  if (first === last) [first, last] = [first - 1, last + 1];
  return [first - margin * (last - first), last + margin * (last - first)];
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
  made.addEventListener("click", () => action(made));
  return made;
}

function labelled(name, options, chosen, told = (value) => value) {
  const select = html("select", {}, ...options.map((value) => html("option", { value }, told(value))));
  select.addEventListener("change", () => chosen(select.value));
  return { select, label: html("label", {}, `${name} `, select) };
}

// One choice for each part of a curve's key that varies; a later one offers what the earlier ones leave.
function chooser({ keys, curves, first = curves[0].key, options = {} }, chosen) {
  const host = html("span", { class: "choices" });
  const key = [...first];
  function build() {
    const had = host.contains(document.activeElement)
      ? [...host.querySelectorAll("select")].findIndex((s) => s === document.activeElement) : -1;
    host.replaceChildren();
    let left = curves;
    keys.forEach((name, i) => {
      const offered = [...new Set(left.map((curve) => curve.key[i]))];
      if (!offered.includes(key[i])) key[i] = offered[0];
      if (new Set(curves.map((curve) => curve.key[i])).size > 1) {
        const { select, label } = labelled(name, offered, (value) => { key[i] = value; build(); },
          (value) => options[value] || value);
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

// What every plot stands in: title with the choice, tools, the drawing, what is read there, and how.
function frame(host, plot, drawing, redrawn) {
  const id = `plot-${(frames += 1)}`;
  const choice = html("small");
  const tools = html("div", { class: "tools" });
  const legend = html("ul", { class: "legend" });
  const read = html("output", { "aria-live": "off" });
  const spoken = html("p", { class: "unseen", "aria-live": "polite" });
  const help = html("details", { class: "help" }, html("summary", {}, "Keys and mouse"),
    html("p", { id: `${id}-help` }, plot.help));
  fill(drawing, { tabindex: "0", role: "application", "aria-label": plot.title, "aria-describedby": `${id}-help` });
  const figure = fill(html("figure", { class: "plot", id, "aria-label": plot.title }), {}, [
    html(plot.heading || "h4", {}, `${plot.title} `, choice), tools, legend, drawing, read, spoken,
    ...(plot.note ? [html("p", { class: "note" }, plot.note)] : []), help]);
  host.append(figure);
  let keyed = false, said = "", width = WIDEST;
  // Only what a key has led to is spoken: a mouse passes over hundreds of values
  drawing.addEventListener("keydown", () => { keyed = true; }, true);
  drawing.addEventListener("keyup", () => { keyed = false; }, true);
  drawing.addEventListener("pointermove", () => { keyed = false; }, true);
  const measure = () => {
    const found = Math.min(WIDEST, Math.round(drawing.getBoundingClientRect().width));
    const changed = found > 0 && found !== width;
    if (found > 0) width = found;
    return changed;
  };
  measure();
  new ResizeObserver(() => measure() && redrawn()).observe(figure);
  return {
    tools, legend,
    width: () => width,
    choose(text) {
      said = text;
      choice.textContent = text;
      drawing.setAttribute("aria-label", text ? `${plot.title}: ${text}` : plot.title);
    },
    tell(text) {
      const parts = (said ? `${text} (${said})` : text).split(/([−\d.]+ ± [\d.]+)/);
      // a value stays on one line with its interval
      read.replaceChildren(...parts.map((part, i) => (i % 2 ? html("span", { class: "short" }, part) : part)));
      if (keyed) spoken.textContent = read.textContent;
    },
  };
}
