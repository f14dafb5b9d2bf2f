// Plots are drawn when their batch is unfolded for the first time; a link to a batch unfolds it.

function unfold(batch) {
  const data = batch.querySelector("script.data");
  if (!data) return;
  const host = batch.querySelector(".plots");
  for (const plot of JSON.parse(data.textContent)) (plot.kind === "map" ? face : chart)(host, plot);
  data.remove();
}

function follow() {
  const batch = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!batch || !batch.matches("details.batch")) return;
  batch.open = true;
  batch.scrollIntoView();
  batch.querySelector("summary").focus();
}

for (const batch of document.querySelectorAll("details.batch")) {
  batch.addEventListener("toggle", () => batch.open && unfold(batch));
}
for (const each of document.querySelectorAll("button[data-fold]")) {
  each.addEventListener("click", () => {
    for (const batch of document.querySelectorAll("details.batch")) batch.open = each.dataset.fold === "open";
  });
}
addEventListener("hashchange", follow);
follow();
