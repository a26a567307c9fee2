"use strict";
// Starts the figures, and keeps figures, lists and words on one chosen touch. Without it the pictures stay.
(async () => {
  const root = document.documentElement;
  if (!("DecompressionStream" in window)) return;
  const unpacked = (id) => {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (each) => each.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  };
  const content = JSON.parse(await unpacked("live-data"));
  document.head.append(Object.assign(document.createElement("script"), { textContent: await unpacked("live-library") }));
  Bokeh.require("core/logging").logger.set_level("warn");  // set_log_level writes to the console itself
  const touches = content.touches;
  root.classList.add("is-live");
  try {
    await Bokeh.embed.embed_items(content.documents, content.items);
  } catch (error) {
    root.classList.remove("is-live");
    throw error;
  }
  const model = (name) => Bokeh.documents[0].get_model_by_name(name);
  // Where no figure has dots of the touches, there is no source of them.
  const source = model("touches"), draws = model("draws"), reference = model("reference"), bars = model("residuals");
  const places = document.getElementById("pick-place"), there = document.getElementById("pick-touch");
  const words = document.getElementById("chosen");
  const [first, second] = touches.shown;
  const given = (value) => value !== null && value !== undefined;
  const shown = (value, digits = 4) => (given(value) ? Number(value.toPrecision(digits)).toString().replace("-", "−") : "–");

  const fixed = (value, sd) => {
    if (!given(value)) return "–";
    const decimals = sd > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(sd)), 0), 6) : 3;
    return value.toFixed(decimals).replace("-", "−");
  };
  const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);

  const tip = (i) => (touches.indenter[i] === "unknown" ? "indenter unknown" : touches.indenter[i]);
  const label = (i) => {
    const axes = ["theta_c", "x", "y"].filter((name) => name in touches.parameters && given(touches.parameters[name].reference[i]));
    if (!axes.length) return `touch ${touches.touch[i]}`;
    // To a hundredth of the unit, wherever the zero of the stage is.
    const text = (each) => withUnit(`${each.symbol} = ${shown(Math.round(100 * each.reference[i]) / 100, 15)}`, each.unit);
    return axes.map((name) => text(touches.parameters[name])).join(", ");
  };
  const groups = new Map();
  touches.touch.forEach((_, i) => groups.set(label(i), [...(groups.get(label(i)) || []), i]));
  const option = (text, value) => Object.assign(document.createElement("option"), { textContent: text, value });
  const order = [...groups].sort((a, b) => {
    const name = "theta_c" in touches.parameters ? "theta_c" : "x";
    const at = (group) => touches.parameters[name].reference[group[1][0]];
    return given(at(a)) && given(at(b)) ? at(a) - at(b) : 0;
  });
  order.forEach(([text]) => places.append(option(text, text)));

  let choosing = false;
  const choose = (i) => {
    if (choosing) return;
    choosing = true;
    places.value = label(i);
    there.replaceChildren(...groups.get(label(i)).map((k) => option(`touch ${touches.touch[k]}, ${tip(k)}`, k)));
    there.value = i;
    draws.data = { x: touches.draws[first][i], y: touches.draws[second][i] };
    const at = [first, second].map((name) => touches.parameters[name].reference[i]);
    reference.data = at.every(given) ? { x: [at[0]], y: [at[1]] } : { x: [], y: [] };
    bars.data = { ...bars.data, z: touches.residuals[i].map((value) => (given(value) ? value : 0)) };
    if (source) source.selected.indices = [i];
    const worst = touches.residuals[i].reduce((best, value, k) => (given(value) && Math.abs(value) > Math.abs(touches.residuals[i][best] ?? 0) ? k : best), 0);
    const parts = Object.values(touches.parameters).map((each) =>
      withUnit(`${each.symbol} ${fixed(each.mean[i], each.sd[i])} ± ${fixed(each.sd[i], each.sd[i])}`, each.unit) +
      (given(each.reference[i]) ? ` (reference ${fixed(each.reference[i], each.sd[i])})` : ""));
    words.textContent = `Touch ${touches.touch[i]}, ${tip(i)}: ${parts.join("; ")}. ` +
      `Largest residual: e${String(worst + 1).padStart(2, "0")}, ${shown(touches.residuals[i][worst])} standard deviations.`;
    choosing = false;
  };
  places.addEventListener("change", () => choose(groups.get(places.value)[0]));
  there.addEventListener("change", () => choose(Number(there.value)));
  if (source) source.selected.properties.indices.change.connect(() => {
    if (!choosing && source.selected.indices.length) choose(source.selected.indices[0]);
  });
  choose(order[Math.floor(order.length / 2)][1][0]);
  root.dataset.ready = "true";
})();
