// Plots are drawn when their batch is unfolded for the first time; a link to a batch unfolds it.

const batches = [...document.querySelectorAll("details.batch")];

function unfold(batch) {
  const data = batch.querySelector("script.data");
  if (!data) return;
  const host = batch.querySelector(".plots");
  const plots = JSON.parse(data.textContent), made = {};
  for (const plot of plots.filter((each) => each.kind !== "trial")) {
    made[plot.title] = (plot.kind === "map" ? face : chart)(host, plot);
  }
  // A trial is drawn above the boundary, on which it puts its mark
  for (const plot of plots.filter((each) => each.kind === "trial")) trial(host, plot, made[plot.boundary]);
  data.remove();
}

function follow(hash) {
  const batch = document.getElementById(decodeURIComponent(hash.slice(1)));
  if (!batch || !batch.matches("details.batch")) return;
  batch.open = true;
  batch.scrollIntoView();
  batch.querySelector("summary").focus();
}

for (const batch of batches) batch.addEventListener("toggle", () => batch.open && unfold(batch));
for (const each of document.querySelectorAll("button[data-fold]")) {
  each.addEventListener("click", () => {
    for (const batch of batches) batch.open = each.dataset.fold === "open";
  });
}
// The second click on a link changes no hash, but the batch may have been folded since the first
for (const link of document.querySelectorAll('a[href^="#batch-"]')) {
  link.addEventListener("click", () => follow(link.hash));
}
addEventListener("hashchange", () => follow(location.hash));

// Paper unfolds nothing: all is drawn before, and folded again after
let folded = [];
addEventListener("beforeprint", () => {
  folded = batches.filter((batch) => !batch.open);
  for (const batch of batches) {
    batch.open = true;
    unfold(batch);
  }
});
addEventListener("afterprint", () => {
  for (const batch of folded) batch.open = false;
});
document.querySelector("header").append(
  search(batches, [...document.querySelectorAll("table[data-verdicts]")]));
const known = document.querySelector("script.compared");
if (known) {
  comparison(document.querySelector(".compare"), JSON.parse(known.textContent));
  const trend = document.querySelector(".trends");
  if (trend) trends(trend, JSON.parse(known.textContent));
}
follow(location.hash);
