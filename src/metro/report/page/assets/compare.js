// Two batches side by side: what both identified, and whether it differs by more than the intervals allow.

function comparison(host, batches) {
  const names = Object.keys(batches);
  const shared = (a, b) => batches[a].filter((one) => batches[b].some((other) => other.name === one.name));
  const pairs = names.flatMap((a, i) => names.slice(i + 1).map((b) => [a, b]));
  const chosen = pairs.reduce((best, pair) => (shared(...pair).length > shared(...best).length ? pair : best));
  const words = html("p", { "aria-live": "polite" }), body = html("tbody");
  const heads = ["quantity", ...chosen, "ratio", "difference"].map((text) => html("th", { scope: "col" }, text));
  const table = html("table", {}, html("caption", {}, "Values with 95 % intervals."),
    html("thead", {}, html("tr", {}, ...heads)), body);
  const box = html("div", { class: "scroll", role: "group", "aria-label": "Quantities of both batches" }, table);

  function row([one, other]) {
    const apart = difference(one, other);
    const whole = (text) => text.replaceAll(" ± ", "\u00a0±\u00a0");
    const cells = [one.name, whole(one.text), whole(other.text), ratio(one, other), apart];
    return html("tr", apart === "differs" ? { class: "differs" } : {}, ...cells.map((text) => html("td", {}, text)));
  }

  function show() {
    const both = shared(...chosen).map((one) => [one, batches[chosen[1]].find((other) => other.name === one.name)]);
    chosen.forEach((name, i) => { heads[i + 1].textContent = name; });
    body.replaceChildren(...both.map(row));
    const apart = both.filter((pair) => difference(...pair) === "differs").length;
    words.textContent = both.length
      ? `${apart} of ${both.length} shared quantities differ by more than their 95 % intervals allow.`
      : "These batches have no quantity in common.";
    box.hidden = !both.length;
  }

  const choices = chosen.map((name, i) => {
    const { select, label } = labelled(["first batch", "second batch"][i], names, (value) => {
      chosen[i] = value;
      show();
    });
    select.value = name;
    return label;
  });
  host.append(html("p", { class: "tools" }, ...choices), words, box);
  show();
}

// The interval of a difference has the root of the sum of squares of both as its half.
function difference(one, other) {
  if (one.half === null || other.half === null) return "interval not known";
  return Math.abs(one.value - other.value) > Math.hypot(one.half, other.half) ? "differs" : "agrees";
}

function ratio(one, other) {
  const share = other.value / one.value;
  if (!Number.isFinite(share) || share <= 0) return "–";
  return share < 1000 ? share.toPrecision(3) : share.toFixed(0);
}
