// A cut that is tried with sliders: its force is computed here, its place is marked on the stability boundary.

const COVERAGE = 1.96; // standard deviations from a value to an end of its 95 % interval
const AXES = ["x", "y", "z"];

// Forces are linear in the coefficients: the sum of what each of them alone brings about.
function composed(tool, parts) {
  const sum = (values) => values.reduce((total, value, k) => total + tool.coefficients[k] * value, 0);
  const force = Object.fromEntries(AXES.map((axis) => [axis,
    parts[0][axis].map((_, i) => sum(parts.map((part) => part[axis][i])))]));
  const torques = parts.map((part) => part.torque);
  const squares = AXES.flatMap((axis) => force[axis].map((each) => each ** 2));
  const error = (tool.error ?? 0) * Math.sqrt(squares.reduce((a, b) => a + b) / squares.length);
  // Half of the 95 % interval: errors of the coefficients, and the error that held-out runs showed
  const half = (values, other) => {
    if (!tool.covariance) return NaN;
    const variance = tool.covariance.reduce((total, row, i) => total
      + row.reduce((part, value, j) => part + value * values[i] * values[j], 0), 0);
    return COVERAGE * Math.sqrt(Math.max(variance, 0) + other ** 2);
  };
  const across = force.x.map((each, i) => Math.hypot(each, force.y[i])), at = across.indexOf(Math.max(...across));
  const along = parts.map((part) => (part.x[at] * force.x[at] + part.y[at] * force.y[at]) / (across[at] || 1));
  const torque = sum(torques);
  return { force, halves: Object.fromEntries(AXES.map((axis) => [axis,
    force[axis].map((_, i) => half(parts.map((part) => part[axis][i]), error))])),
    peak: [across[at], half(along, error)], torque: [torque, half(torques, (tool.error ?? 0) * torque)] };
}

// A value with its interval to two digits of that, where it is known.
function withInterval(value, half) {
  if (!(half > 0)) return String(Number(value.toPrecision(3)));
  const decimals = 1 - Math.floor(Math.log10(half));
  return `${fixed(value, decimals)} ± ${fixed(half, decimals)}`;
}

function trial(host, plot, boundary) {
  const degrees = Array.from({ length: 360 }, (_, i) => i);
  const chosen = Object.fromEntries(plot.sliders.map(({ key, value }) => [key, value]));
  const told = html("p", { role: "status", class: "tried" }), sliders = html("div", { class: "sliders" });
  const place = host.querySelector(".plot");

  function curve() {
    const cut = { depth: chosen.depth, feed: chosen.feed };
    const runout = { radius: chosen.runout / 1000, angle: plot.tool.runout };
    const parts = plot.tool.coefficients.map((_, k) => cutForce(
      { ...plot.tool, coefficients: plot.tool.coefficients.map((__, i) => (i === k ? 1 : 0)) }, cut, runout));
    const force = composed(plot.tool, parts);
    const lines = [["along the feed", "after", "x"], ["across the feed", "before", "y"], ["along the axis", "measured", "z"]]
      .map(([name, look, axis]) => {
        const value = force.force[axis], half = force.halves[axis];
        const ends = plot.tool.covariance ? { low: value.map((y, i) => y - half[i]), high: value.map((y, i) => y + half[i]) } : {};
        return { name, look, y: value, ...ends };
      });
    return { force, drawn: { key: [], said: "", x: degrees, lines, decimals: plot.decimals } };
  }

  const { force, drawn: first } = curve();
  const drawing = chart(host, { ...plot, keys: [], curves: [first] });
  const figure = host.lastElementChild;
  host.insertBefore(figure, place);
  figure.querySelector(".tools").before(sliders, told);

  function tell({ peak, torque }) {
    const power = torque.map((each) => (each * chosen.rpm * TURN) / 60);
    const parts = [["Largest force across the axis", peak, "N"], ["mean torque", torque, "N m"], ["power", power, "W"]]
      .map(([name, value, unit]) => `${name} ${withInterval(...value)} ${unit}`);
    told.textContent = `${parts.join("; ")}.`;
    if (!boundary) return;
    const here = boundary.put(chosen.rpm, chosen.depth, `The cut that is tried: ${chosen.depth} mm at ${chosen.rpm} rpm`);
    const verdict = chosen.depth < here.low ? "is predicted to be stable"
      : chosen.depth > here.high ? "is predicted to chatter" : "is within the interval of the boundary";
    told.textContent += ` The cut ${verdict}${here.said ? ` at ${here.said}` : ""} (boundary: ${here.told}).`;
  }

  for (const { key, name, unit, low, high, step, value } of plot.sliders) {
    const input = html("input", { type: "range", min: low, max: high, step, value });
    const shown = html("output", {}, `${value} ${unit}`);
    input.addEventListener("input", () => {
      chosen[key] = Number(input.value);
      shown.textContent = `${input.value} ${unit}`;
      const next = curve();
      drawing.show(next.drawn);
      tell(next.force);
    });
    sliders.append(html("label", {}, html("span", {}, name), input, shown));
  }
  tell(force);
}
