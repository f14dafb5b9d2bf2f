// A search over the verdicts and the batches: what does not hold every word is hidden.

function search(batches, tables) {
  const rows = tables.flatMap((table) => [...table.tBodies[0].rows]);
  const texts = [...batches, ...rows].map((element) => {
    const data = element.querySelector("script.data");
    const told = element.textContent.replace(data ? data.textContent : "", "");
    return [element, `${element.id} ${told}`.toLowerCase()];
  });
  const field = html("input", { type: "search", placeholder: "batch, effect, quantity …" });
  const found = html("span", { role: "status" });
  field.addEventListener("input", () => {
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const [element, text] of texts) {
      element.classList.toggle("missed", !words.every((word) => text.includes(word)));
    }
    const left = batches.filter((batch) => !batch.classList.contains("missed")).length;
    found.textContent = words.length ? `${left} of ${batches.length} batches` : "";
  });
  return html("p", { class: "tools" }, html("label", {}, "Search ", field), found);
}
