// A quantity over the batches that identified it, in the order in which they were measured.

function trends(host, batches) {
  const names = Object.keys(batches), rows = Object.values(batches).flat();
  const quantities = [...new Map(rows.map((one) => [one.name, one.unit])).keys()];
  const having = (quantity) => names.filter((name) => batches[name].some((one) => one.name === quantity));
  const curves = quantities.filter((quantity) => having(quantity).length > 1).map((quantity) => {
    const at = having(quantity);
    const entries = at.map((name) => batches[name].find((one) => one.name === quantity));
    const half = (sign) => entries.map(({ value, half: width }) => (width === null ? NaN : value + sign * width));
    const { unit, decimals } = entries[0];
    return { key: [quantity], said: quantity, rows: at, x: at.map((_, i) => i + 1), unit, decimals,
      label: unit === "" ? quantity : `${quantity} (${unit})`,
      lines: [{ name: "identified", look: "measured", y: entries.map(({ value }) => value), low: half(-1), high: half(1) }] };
  });
  const most = curves.reduce((best, one) => (one.rows.length > best.rows.length ? one : best));
  chart(host, { title: "Trend", heading: "h3", x: "batch", keys: ["quantity"], curves, first: most.key,
    note: host.dataset.note, help: host.dataset.help });
}
