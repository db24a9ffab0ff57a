// Makes the page's pictures live: the same curves, drawn by uPlot, with zoom and hover. Without this
// script, and in print, the pictures themselves are shown.

var all = [];

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function digits(value) {
  if (value == null) return "–";
  var size = Math.abs(value);
  var text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(3) : String(+value.toPrecision(4));
  return text.replace(/-/g, "−");
}

// Names of an axis's ticks, all in one style: plain, or all with powers of ten where one of them needs it.
function tickNames(splits) {
  var sizes = splits.map(Math.abs).filter(function (size) { return size > 0; });
  var least = sizes.length > 1 ? Math.min.apply(null, sizes) : sizes[0], most = Math.max.apply(null, sizes);
  if (!(least < 1e-3 || most >= 1e6)) return splits.map(tickWords);
  return splits.map(function (value) {
    if (value === 0) return "0";
    var parts = (+value.toPrecision(8)).toExponential().split("e"), power = "10" + raised(+parts[1]);
    return (parts[0] === "1" ? power : parts[0] === "-1" ? "-" + power : parts[0] + "·" + power).replace(/-/g, "−");
  });
}

function raised(exponent) {
  return String(exponent).split("").map(function (sign) { return sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign]; }).join("");
}

function tickWords(value) {
  var size = Math.abs(value);
  return (size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential() : String(+value.toPrecision(8))).replace(/-/g, "−");
}

function element(name, className, text) {
  var made = document.createElement(name);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}

function unit(words) { return words && words !== "1" ? " " + words : ""; }

// Half-line bands and lines of the resonances; names above the topmost panel only.
function drawMarks(marks, top) {
  return function (u) {
    var c = u.ctx, box = u.bbox, ratio = devicePixelRatio || 1, free = -Infinity;
    c.save();
    c.font = 12 * ratio + "px system-ui, sans-serif";
    c.textAlign = "center";
    marks.forEach(function (mark) {
      var x = u.valToPos(mark.at, "x", true);
      if (x < box.left || x > box.left + box.width) return;
      c.strokeStyle = c.fillStyle = color(mark.mode ? "--mode" : "--other");
      var from = Math.max(u.valToPos(mark.line - mark.half, "x", true), box.left);
      var to = Math.min(u.valToPos(mark.line + mark.half, "x", true), box.left + box.width);
      c.globalAlpha = 0.18;
      c.fillRect(from, box.top, Math.max(to - from, 1), box.height);
      c.globalAlpha = 0.9;
      c.setLineDash(mark.mode ? [6 * ratio, 4 * ratio] : [2 * ratio, 4 * ratio]);
      c.lineWidth = ratio;
      c.beginPath();
      c.moveTo(x, box.top);
      c.lineTo(x, box.top + box.height);
      c.stroke();
      var half = c.measureText(mark.name).width / 2 + 4 * ratio;
      if (top && x - half > free) {
        c.globalAlpha = 1;
        c.fillText(mark.name, x, box.top - 6 * ratio);
        free = x + half;
      }
    });
    c.restore();
  };
}

// Taps: dots for used ones, crosses for rejected ones, with their numbers where there is room.
function drawTaps(taps, state) {
  return function (u) {
    var c = u.ctx, box = u.bbox, ratio = devicePixelRatio || 1, free = -Infinity;
    c.save();
    c.font = 12 * ratio + "px system-ui, sans-serif";
    c.textAlign = "center";
    c.textBaseline = "middle";
    taps.forEach(function (tap, index) {
      var x = u.valToPos(tap.at, "x", true);
      if (tap.peak == null || x < box.left || x > box.left + box.width) return;
      var y = Math.min(Math.max(u.valToPos(tap.peak, "y", true), box.top + 6 * ratio), box.top + box.height - 6 * ratio);
      var size = (index === state.tap ? 8 : 5) * ratio;
      c.strokeStyle = c.fillStyle = color(tap.used ? "--mode" : "--bad");
      c.lineWidth = 2.5 * ratio;
      c.beginPath();
      if (tap.used) {
        c.arc(x, y, size, 0, 2 * Math.PI);
        c.fill();
      } else {
        c.moveTo(x - size, y - size); c.lineTo(x + size, y + size);
        c.moveTo(x - size, y + size); c.lineTo(x + size, y - size);
        c.stroke();
      }
      var number = String(index + 1), half = c.measureText(number).width / 2 + 2 * ratio;
      if (index !== state.tap && x - half < free) return;
      free = x + half;
      c.fillText(number, x, y + (tap.peak < 0 ? 1 : -1) * (size + 9 * ratio));
    });
    c.restore();
  };
}

// Every place of equally spaced points.
function places(runs) {
  var all = [];
  runs.forEach(function (run) { for (var i = 0; i < run.count; i++) all.push(run.first + i * run.step); });
  return all;
}

// The samples about a chosen tap, below the recording: one panel for the force, one for the response.
function closeUp(figure, tap) {
  (figure.near || []).forEach(function (u) { u.destroy(); });
  figure.near = [];
  figure.nearHost.textContent = "";
  if (!tap || !tap.close_up.length) return false;
  figure.near = tap.close_up.map(function (panel, index) {
    var last = index === tap.close_up.length - 1, curve = panel.series[0];
    panel.x.label = "time from the trigger of " + tap.name;
    return new uPlot({
      width: Math.max(figure.nearHost.clientWidth, 240), height: 190 + (last ? 36 : 0), padding: [8, 30, 0, 0],
      axes: axes(panel, last), scales: { x: { time: false }, y: { range: padded } },
      series: [{ label: "time", value: function (u, v) { return v == null ? "–" : digits(v) + " ms"; } },
        { label: panel.y.label, stroke: color(index ? "--c0" : "--soft"), width: 1.5, value: function (u, v) { return digits(v) + (v == null ? "" : unit(panel.y.unit)); } }],
      cursor: { sync: { key: figure.key + "near", scales: ["x", null] }, drag: { x: true, y: false } }
    }, [places(curve.x), curve.y], figure.nearHost);
  });
  var note = tap.close_up[0].note;
  if (note) figure.nearHost.appendChild(element("p", "note", note));
  return true;
}

function axes(panel, last, log) {
  var ink = color("--ink"), rule = color("--rule");
  var common = { stroke: ink, grid: { stroke: rule, width: 1 }, ticks: { stroke: rule, width: 1 } };
  var narrow = innerWidth < 600;
  return [
    Object.assign({}, common, { label: last ? panel.x.label + " (" + panel.x.unit + ")" : "", labelSize: last ? 22 : 0, size: last ? 34 : 8,
      values: function (u, splits) { return last ? tickNames(splits) : []; } }, !log ? {} : {
      splits: function (u, index, low, high) { return ticks(low, high, true, narrow); },
      filter: function (u, splits) { return splits; }
    }),
    Object.assign({}, common, {
      label: panel.y.label + " (" + (panel.y.unit || "unit of the file") + ")", labelSize: 20, size: narrow ? 56 : 62, space: 28,
      values: function (u, splits) { return tickNames(splits); }
    }, !logarithmic(panel.y) ? {} : {
      splits: function (u, index, low, high) { return ticks(low, high, true); },
      filter: function (u, splits) { return splits; }
    })
  ];
}

// Room above and below what is shown.
var padded = { min: { pad: 0.08 }, max: { pad: 0.14 } };

function isBand(curve) { return curve.mark === "band"; }

function vertical(panel) {
  if (!logarithmic(panel.y)) return { range: panel.y.fits || panel.series.some(isBand) ? padded : [panel.y.low, panel.y.high] };
  return {
    distr: 3,
    // As in the pictures, 140 dB below the largest are shown at most.
    range: function (u, low, high) { return high > 0 ? [Math.max(low, high * 1e-7) / 1.4, high * 1.6] : [0.1, 1]; }
  };
}

// The curves of a panel; a band is two.
function curves(panel) {
  return [].concat.apply([], panel.series.map(function (curve) {
    if (!isBand(curve)) return [curve];
    return [["smallest", curve.low], ["largest", curve.high]].map(function (end) {
      return Object.assign({}, curve, { name: end[0], y: end[1] });
    });
  }));
}

function options(figure, index) {
  var all = figure.curves, panel = all[index], last = index === all.length - 1;
  var taps = figure.plot.kind === "taps";
  var series = [{ label: panel.x.label, value: function (u, v) { return v == null ? "–" : +v.toPrecision(7) + " " + panel.x.unit; } }];
  curves(panel).forEach(function (curve) {
    series.push({
      label: curve.name, stroke: color("--" + curve.color), alpha: curve.opacity, width: curve.size || 1.5, spanGaps: false,
      points: { show: taps ? false : undefined },
      value: function (u, v) { return digits(v) + (v == null ? "" : unit(panel.y.unit)); }
    });
  });
  var draw = [taps ? drawTaps(figure.taps, figure) : drawMarks(figure.marks, index === 0)];
  return {
    width: Math.max(figure.host.clientWidth, 240),
    height: Math.min(panel.height, 280) + (last ? 36 : 0),
    series: series, axes: axes(panel, last, figure.log),
    scales: { x: { time: false, distr: figure.log ? 3 : 1 }, y: vertical(panel) },
    bands: taps ? [{ series: [2, 1], fill: color("--data") + "55" }] : [],
    padding: [index === 0 ? 22 : 8, 30, 0, 0],
    cursor: { sync: { key: figure.key, scales: ["x", null] }, drag: { x: true, y: false } },
    hooks: { draw: draw }
  };
}

function zoom(figure, low, high) {
  var x = figure.x, end = x[x.length - 1];
  // A logarithmic axis has no zero.
  var begin = figure.log ? x.find(function (place) { return place > 0; }) : x[0];
  figure.panels.forEach(function (u) {
    u.setScale("x", { min: Math.max(low, begin), max: Math.min(high, end) });
  });
}

function whole(figure) { zoom(figure, -Infinity, Infinity); }

function build(figure) {
  closeUp(figure, figure.taps[figure.tap]);
  if (figure.points) return buildPoints(figure);
  figure.panels.forEach(function (u) { u.destroy(); });
  figure.host.textContent = "";
  figure.panels = figure.curves.map(function (panel, index) {
    var period = panel.y.period;
    var data = [figure.x].concat(curves(panel).map(function (curve) {
      var values = curve.y;
      if (logarithmic(panel.y)) return values.map(function (v) { return v > 0 ? v : null; });
      // No line where values come round again, as a phase does.
      return !period ? values : values.map(function (v, i) {
        return i > 0 && v != null && values[i - 1] != null && Math.abs(v - values[i - 1]) > period / 2 ? null : v;
      });
    }));
    var u = new uPlot(options(figure, index), data, figure.host);
    fingers(u, { x: [figure.x[0], figure.x[figure.x.length - 1]] }, function (x) { zoom(figure, x[0], x[1]); });
    return u;
  });
  // Like the picture the curves first end where the modes do.
  if (figure.plot.kind !== "taps") zoom(figure, figure.curves[0].x.low, figure.curves[0].x.high);
}

function chosen(figure, index) {
  var tap = figure.taps[index], x = figure.x, reach = Math.max(20 * finest(figure), 0.02 * x[x.length - 1]);
  figure.tap = index;
  figure.said.textContent = tap.name + ": " + tap.words;
  // The recording stays whole where the samples themselves are shown below it.
  if (closeUp(figure, tap)) whole(figure);
  else zoom(figure, tap.at - 0.25 * reach, tap.at + reach);
}

function chips(figure) {
  figure.bar.textContent = "";
  function chip(words, className, action) {
    var button = element("button", className, words);
    button.type = "button";
    button.addEventListener("click", function () { action(button); });
    figure.bar.appendChild(button);
  }
  figure.views.forEach(function (view) {
    chip(view[0], view[1] === figure.plot ? "view chosen" : "view", function () {
      adopt(figure, view[1]);
      chips(figure);
      build(figure);
    });
  });
  if (!figure.points && figure.plot.kind !== "taps") chip(figure.log ? "linear frequency" : "log frequency", "view", function () {
    figure.log = !figure.log;
    chips(figure);
    build(figure);
  });
  if (figure.points) pointChips(figure, chip);
  else curveChips(figure, chip);
  chip("picture", "reset", function () { figure.element.classList.toggle("still"); });
}

// Takes what is shown out of a plot. Curves stand over runs of equally spaced places, single points over places of
// their own.
function adopt(figure, plot) {
  var panels = plot.blocks[0].panels, first = panels[0].series[0];
  figure.points = !(first && first.x[0] && first.x[0].count);
  figure.plot = plot;
  figure.tap = -1;
  figure.shown = 0;
  figure.taps = [];
  figure.marks = [];
  figure.host.classList.toggle("points", figure.points);
  if (figure.points) return;
  figure.curves = panels;
  figure.x = places(first.x);
  figure.marks = panels[0].rules;
  figure.taps = panels[0].events;
  figure.taps.forEach(function (tap, number) { tap.name = "tap " + (number + 1); });
}

// The least distance of points.
function finest(figure) {
  return Math.min.apply(null, figure.curves[0].series[0].x.map(function (run) { return run.step; }));
}

function curveChips(figure, chip) {
  chip("whole range", "reset", function () { figure.tap = -1; figure.said.textContent = ""; closeUp(figure, null); whole(figure); });
  figure.marks.forEach(function (mark) {
    chip(mark.name + ", " + mark.words, mark.mode ? "mode" : "other", function () {
      var reach = Math.max(40 * mark.half, 10 * finest(figure));
      zoom(figure, mark.at - reach, mark.at + reach);
    });
  });
  figure.taps.forEach(function (tap, index) {
    chip((tap.used ? "● " : "✕ ") + tap.name, tap.used ? "mode" : "bad", function () { chosen(figure, index); });
  });
}

// A click without a drag takes the nearest tap.
function clicks(figure) {
  if (figure.plot.kind !== "taps") return;
  figure.host.addEventListener("click", function (event) {
    var over = event.target.closest(".u-over"), u = figure.panels[0];
    if (!over || !u) return;
    var at = event.clientX - over.getBoundingClientRect().left, best = -1, near = 14;
    figure.taps.forEach(function (tap, index) {
      var distance = Math.abs(u.valToPos(tap.at, "x") - at);
      if (distance < near) { near = distance; best = index; }
    });
    if (best >= 0) chosen(figure, best);
  });
}

// The curves of a figure, deflated and in base 64. Where a browser cannot inflate, the picture stays.
function unpacked(node) {
  var text = atob(node.querySelector("script").textContent);
  var bytes = Uint8Array.from(text, function (sign) { return sign.charCodeAt(0); });
  var stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).text().then(JSON.parse);
}

function start(node, index, plot) {
  var figure = { element: node, key: "figure" + index, panels: [], log: false, views: viewsOf(plot) };
  var live = element("div", "plot");
  figure.bar = element("div", "chips");
  figure.host = element("div", "host");
  figure.said = element("p", "said");
  figure.said.setAttribute("aria-live", "polite");
  figure.nearHost = element("div", "host near");
  var note = "Drag over a range to zoom, double click for the whole range; two fingers zoom, one moves. " + plot.blocks[0].panels[0].note;
  figure.poleLine = element("p", "poles");
  [figure.bar, figure.host, figure.said, figure.poleLine, figure.nearHost, element("p", "note", note)].forEach(function (part) { live.appendChild(part); });
  node.insertBefore(live, node.firstChild);
  node.classList.add("live");
  adopt(figure, plot);
  if (choosesPoles(figure)) startPoles(figure);
  if (figure.points) plot.blocks.forEach(function (block) { block.panels.forEach(function (panel) { ends(panel.x); ends(panel.y); }); });
  chips(figure);
  build(figure);
  clicks(figure);
  all.push(figure);
  all.filter(choosesPoles).forEach(showPoles);
}

var nodes = Array.from(document.querySelectorAll("figure.curves"));
if (window.DecompressionStream) Promise.allSettled(nodes.map(unpacked)).then(function (found) {
  found.forEach(function (one, index) { if (one.value) start(nodes[index], index, one.value); });
});
addEventListener("resize", function () {
  all.forEach(function (figure) {
    figure.panels.concat(figure.near || []).forEach(function (u) {
      var width = Math.max(u.root.parentNode.clientWidth, 240);
      if (u.width !== width) u.setSize({ width: width, height: u.height });
    });
  });
});
// Canvases do not follow the page's colours by themselves.
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", function () { all.forEach(build); });
