// A cut that is tried with sliders: its force is computed here, its place is marked on the stability boundary.

function trial(host, plot, boundary) {
  const degrees = Array.from({ length: 360 }, (_, i) => i);
  const chosen = Object.fromEntries(plot.sliders.map(({ key, value }) => [key, value]));
  const told = html("p", { role: "status", class: "tried" }), sliders = html("div", { class: "sliders" });
  const place = host.querySelector(".plot");

  function curve() {
    const cut = { depth: chosen.depth, feed: chosen.feed };
    const force = cutForce(plot.tool, cut, { radius: chosen.runout / 1000, angle: plot.tool.runout });
    const lines = [["along the feed", "after", "x"], ["across the feed", "before", "y"], ["along the axis", "measured", "z"]]
      .map(([name, look, axis]) => ({ name, look, y: force[axis] }));
    return { force, drawn: { key: [], said: "", x: degrees, lines, decimals: plot.decimals } };
  }

  const { force, drawn: first } = curve();
  const drawing = chart(host, { ...plot, keys: [], curves: [first] });
  const figure = host.lastElementChild;
  host.insertBefore(figure, place);
  figure.querySelector(".tools").before(sliders, told);

  function tell({ x, y, torque }) {
    const peak = Math.max(...x.map((each, i) => Math.hypot(each, y[i])));
    const power = (torque * chosen.rpm * TURN) / 60;
    const parts = [["Largest force across the axis", peak, "N"], ["mean torque", torque, "N m"], ["power", power, "W"]]
      .map(([name, value, unit]) => `${name} ${Number(value.toPrecision(3))} ${unit}`);
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
