"use strict";
// The page of `tapjoint listen`. The address holds the token; every path here is relative to it.
(() => {
  const byId = (id) => document.getElementById(id);
  let chosen = null;
  let newest = null;
  let bench = { taps: [] };
  let shown = "";

  // The tap that is chosen, or the last one that is shown.
  function act(action) {
    const last = bench.taps.length ? bench.taps[bench.taps.length - 1].time : null;
    const body = JSON.stringify({ action, time: chosen === null ? last : chosen });
    fetch("act", { method: "POST", headers: { "Content-Type": "application/json" }, body })
      .then((answer) => { if (!answer.ok) lost(); })
      .catch(lost);
  }

  function lost() {
    if (bench.ended) return;
    byId("advice").textContent = "The program does not answer any more.";
    byId("advice").classList.remove("enough");
    for (const button of document.querySelectorAll("#actions button")) button.disabled = true;
  }

  function items(list, texts) {
    list.replaceChildren(...texts.map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    }));
  }

  // True where the taps differ from those that were shown last.
  function changed(taps) {
    const before = shown;
    shown = JSON.stringify(taps);
    return shown !== before;
  }

  function choose(time) {
    chosen = chosen === time ? null : time;
    showTaps();
  }

  function showTaps() {
    const taps = bench.taps;
    // The trigger of a tap may move a little: 50 ms name it.
    const own = taps.find((tap) => chosen !== null && Math.abs(tap.time - chosen) <= 0.05);
    // The next tap takes the choice back.
    const last = taps.length ? taps[taps.length - 1].time : null;
    chosen = own && last <= newest + 0.05 ? own.time : null;
    newest = last;
    byId("taps").replaceChildren(...taps.map((tap) => {
      const item = document.createElement("li");
      item.className = tap.accepted ? (tap.overruled ? "overruled" : "") : "rejected";
      const button = document.createElement("button");
      const time = document.createElement("b");
      time.textContent = tap.time.toFixed(2) + " s ";
      button.append(time, tap.words);
      button.setAttribute("aria-pressed", String(tap.time === chosen));
      button.addEventListener("click", () => choose(tap.time));
      item.append(button);
      return item;
    }));
    byId("chosen").textContent = chosen === null ? "the last tap" : "the tap at " + chosen.toFixed(2) + " s";
    byId("earlier").hidden = !bench.left_out;
    byId("earlier").textContent = bench.left_out + " earlier taps are not shown";
  }

  function showBench(data) {
    const report = bench.report;
    bench = data;
    byId("title").textContent = bench.title;
    document.title = bench.title + " – tapjoint";
    byId("advice").textContent = bench.ended || bench.advice;
    byId("advice").classList.toggle("enough", bench.is_enough && !bench.ended);
    byId("advice").classList.toggle("ended", Boolean(bench.ended));
    byId("next").hidden = !bench.next;
    byId("next").textContent = "Next: " + bench.next;
    // The report says the same and more.
    byId("result-head").textContent = bench.result_head;
    items(byId("result"), bench.result.length ? bench.result : ["no result yet"]);
    byId("precision").textContent = bench.precision;
    items(byId("notes"), bench.notes.slice().reverse());
    byId("notes-head").hidden = bench.notes.length === 0;
    // Only then: a button that is made anew loses the focus, or half a click.
    if (changed(bench.taps)) showTaps();
    if (!bench.report) byId("report").hidden = true;
    byId("result").hidden = !byId("report").hidden;
    if (bench.report !== report && bench.report > 0) showReport(bench.report);
    for (const button of document.querySelectorAll("#actions button")) button.disabled = Boolean(bench.ended);
  }

  // Shows a report in place of the last one, once it is there.
  function showReport(number) {
    const frame = byId("report").cloneNode();
    frame.removeAttribute("id");
    frame.hidden = true;
    frame.src = "report?" + number;
    frame.addEventListener("load", () => {
      if (number !== bench.report) return frame.remove();
      byId("report").remove();
      frame.id = "report";
      frame.hidden = false;
      byId("result").hidden = true;
    });
    byId("report").after(frame);
  }

  // Swings of a channel in thousandths of the largest, as steps, the newest on the right.
  function outline(swings) {
    const first = 200 - swings.length;
    let path = "M" + first + " 20";
    swings.forEach((swing, place) => {
      const height = (20 - 19 * swing / 1000).toFixed(1);
      path += "V" + height + "H" + (first + place + 1);
    });
    return path + "V20Z";
  }

  function showPulse(pulse) {
    byId("time").textContent = pulse.seconds.toFixed(1) + " s";
    const rows = byId("levels");
    while (rows.children.length > pulse.levels.length) rows.lastChild.remove();
    pulse.levels.forEach((level, place) => {
      let row = rows.children[place];
      if (!row) {
        row = document.createElement("div");
        row.className = "level";
        row.innerHTML = "<span></span><svg viewBox='0 0 200 20' preserveAspectRatio='none'><path/></svg>";
        rows.append(row);
      }
      row.querySelector("span").textContent = level.name;
      row.querySelector("path").setAttribute("d", outline(level.recent));
    });
  }

  for (const button of document.querySelectorAll("#actions button")) {
    button.addEventListener("click", () => act(button.dataset.action));
  }
  const events = new EventSource("events");
  events.addEventListener("bench", (event) => {
    showBench(JSON.parse(event.data));
  });
  events.addEventListener("pulse", (event) => showPulse(JSON.parse(event.data)));
  // The browser tries again by itself.
  events.onerror = () => {
    if (bench.ended) events.close();
    lost();
  };
  showTaps();
})();
