// Panels of single points, drawn by uPlot's axes and zoom and by hand: stabilisation diagram, clouds of
// estimates, frequency and damping against amplitude, errors and shapes of the model. And fingers on all plots.

var reach = 24; // pixels within which a point answers the pointer

// The ends of an axis, and its named places apart from their names.
function ends(axis) {
  axis.range = [axis.low, axis.high];
  if (!axis.names) return;
  axis.at = axis.names.map(function (tick) { return tick.value; });
  axis.names = axis.names.map(function (tick) { return tick.label; });
}

function logarithmic(axis) { return axis.scale === "logarithmic"; }

// A title of at most `room` pixels: its words give way at their end, its unit stays.
function named(axis, room) {
  var unit = axis.unit ? " (" + axis.unit + ")" : "", most = Math.max(Math.floor(room / 7) - unit.length, 8);
  return (axis.label.length > most ? axis.label.slice(0, most - 1).trim() + "…" : axis.label) + unit;
}

// Powers of ten with 2 and 5 where there are several and room for them, else equal steps.
function ticks(low, high, log, narrow) {
  var found = [];
  if (log && high / low > 8) {
    var parts = high / low > (narrow ? 100 : 2000) ? [1] : [1, 2, 5];
    for (var e = Math.floor(Math.log10(low)); e <= Math.log10(high); e++) {
      parts.forEach(function (part) {
        var value = +(part + "e" + e);
        if (value >= low && value <= high) found.push(value);
      });
    }
    return found;
  }
  var raw = (high - low) / 5, power = Math.pow(10, Math.floor(Math.log10(raw)));
  var step = power * (raw / power > 5 ? 10 : raw / power > 2 ? 5 : raw / power > 1 ? 2 : 1);
  for (var i = Math.ceil(low / step); i <= high / step; i++) found.push(+(i * step).toPrecision(12));
  return found;
}


// A set that is only looked at.
function mute(set) { return set.mark === "line" || set.mark === "band"; }

function within(axis, value) { return value >= axis[0] && value <= axis[1]; }

// A bar is seen where its row is: its end may lie beyond what is shown.
function shown(set, i, xs, ys) { return (set.mark === "bar" || within(xs, set.x[i])) && within(ys, set.y[i]); }

function drawSet(u, panel, set, lit) {
  var c = u.ctx, ratio = devicePixelRatio || 1, size = set.size * ratio;
  var factor = set.name === "mode shape" || set.name === "measured" ? (panel.swing == null ? 1 : panel.swing) : 1;
  function px(i) { return u.valToPos(set.x[i], "x", true); }
  function py(value) { return u.valToPos(factor * value, "y", true); }
  c.strokeStyle = c.fillStyle = color("--" + set.color);
  var curve = set.mark === "curve";
  c.lineWidth = (set.mark === "line" || curve ? set.size : 1.6) * ratio;
  if (mute(set) || curve) {
    if (set.low) {
      c.beginPath();
      set.high.forEach(function (value, i) { c[i ? "lineTo" : "moveTo"](px(i), py(value)); });
      for (var i = set.low.length - 1; i >= 0; i--) c.lineTo(px(i), py(set.low[i]));
      c.globalAlpha = 0.25;
      c.fill();
      c.globalAlpha = 1;
    }
    c.beginPath();
    set.y.forEach(function (value, i) { c[i ? "lineTo" : "moveTo"](px(i), py(value)); });
    c.stroke();
    if (!curve) return;
  }
  var xs = panel.view.x, ys = panel.view.y;
  set.x.forEach(function (value, i) {
    if (!shown(set, i, xs, ys)) return;
    var chosen = lit && lit.set === set && lit.index === i;
    var x = px(i), y = py(set.y[i]), r = chosen ? 1.8 * size : size;
    if (set.mark === "bar") {
      var from = u.valToPos(0, "x", true);
      c.globalAlpha = chosen ? 1 : 0.8;
      c.fillRect(from, y - size, Math.max(x - from, ratio), 2 * size);
      c.globalAlpha = 1;
      return;
    }
    if (set.low && !curve) {
      c.lineWidth = 1.2 * ratio;
      c.beginPath(); c.moveTo(x, py(set.low[i])); c.lineTo(x, py(set.high[i])); c.stroke();
    }
    if (curve && !chosen) return;
    c.beginPath();
    if (set.mark === "square") c.fillRect(x - r, y - r, 2 * r, 2 * r);
    else if (set.mark === "cross") {
      c.moveTo(x - r, y - r); c.lineTo(x + r, y + r);
      c.moveTo(x - r, y + r); c.lineTo(x + r, y - r);
      c.stroke();
    } else {
      c.arc(x, y, r, 0, 2 * Math.PI);
      if (set.mark === "dot" || curve) c.fill(); else c.stroke();
    }
  });
}

function drawRules(u, panel) {
  var c = u.ctx, box = u.bbox, ratio = devicePixelRatio || 1, taken = [];
  c.font = 12 * ratio + "px system-ui, sans-serif";
  c.textAlign = "center";
  // Modes first: where names have no room for each other, those of modes stay.
  var rules = panel.rules.slice().sort(function (a, b) { return b.mode - a.mode; });
  rules.forEach(function (rule) {
    if (!within(panel.view.x, rule.at)) return;
    var x = u.valToPos(rule.at, "x", true), half = c.measureText(rule.name).width / 2 + 4 * ratio;
    var middle = Math.min(x, c.canvas.width - half);
    c.strokeStyle = c.fillStyle = color(rule.mode ? "--mode" : "--other");
    c.lineWidth = ratio;
    c.setLineDash(rule.mode ? [6 * ratio, 4 * ratio] : [2 * ratio, 4 * ratio]);
    c.beginPath(); c.moveTo(x, box.top); c.lineTo(x, box.top + box.height); c.stroke();
    c.setLineDash([]);
    if (taken.every(function (other) { return middle - half > other[1] || middle + half < other[0]; })) {
      c.fillText(rule.name, middle, box.top - 6 * ratio);
      taken.push([middle - half, middle + half]);
    }
  });
}

function drawPanel(panel) {
  return function (u) {
    var c = u.ctx, box = u.bbox;
    c.save();
    drawRules(u, panel);
    c.beginPath(); c.rect(box.left, box.top, box.width, box.height); c.clip();
    panel.series.forEach(function (set) { drawSet(u, panel, set, panel.lit); });
    c.restore();
  };
}

// The point nearest to the pointer, and what it says.
function nearest(u, panel, left, top) {
  var best = null, near = reach;
  panel.series.forEach(function (set) {
    if (mute(set)) return;
    set.x.forEach(function (value, i) {
      if (!shown(set, i, panel.view.x, panel.view.y)) return;
      // A bar answers all along its row.
      var aside = set.mark === "bar" ? 0 : u.valToPos(value, "x") - left;
      var distance = Math.hypot(aside, u.valToPos(set.y[i], "y") - top);
      if (distance <= near) { near = distance; best = { set: set, index: i }; }
    });
  });
  return best;
}

function saying(panel, point) {
  var set = point.set, i = point.index;
  function one(label, value, of) { return label + " " + tickWords(value) + unit(of); }
  var parts = [set.words ? set.name + ", " + set.words[i] : set.name];
  // Where an axis has names, the point's own words say which.
  if (!panel.x.at) parts.push(one(panel.x.label, set.x[i], panel.x.unit));
  var bar = set.high ? " ± " + +(0.5 * (set.high[i] - set.low[i])).toPrecision(2) : "";
  if (!panel.y.at) parts.push(panel.y.label + " " + (set.said ? set.said[i] : tickWords(set.y[i]) + bar + unit(panel.y.unit)));
  if (set.extra) parts.push(one(panel.extra[0], set.extra[i], panel.extra[1]));
  return parts.join(" · ");
}

function hover(figure, panel) {
  return function (u) {
    var left = u.cursor.left, top = u.cursor.top, tip = panel.tip;
    var lit = left >= 0 ? nearest(u, panel, left, top) : null;
    var same = lit && panel.lit && lit.set === panel.lit.set && lit.index === panel.lit.index;
    if (!same && (lit || panel.lit)) { panel.lit = lit; u.redraw(false); }
    tip.style.display = lit ? "block" : "none";
    if (!lit) return;
    tip.textContent = saying(panel, lit);
    var wide = u.over.clientWidth, x = Math.min(Math.max(u.valToPos(lit.set.x[lit.index], "x"), 0), wide), y = u.valToPos(lit.set.y[lit.index], "y");
    tip.style.left = x < wide / 2 ? x + 12 + "px" : "auto";
    tip.style.right = x < wide / 2 ? "auto" : wide - x + 12 + "px";
    tip.style.top = Math.max(y - 34, 0) + "px";
  };
}

function look(figure, u, panel, x, y) {
  function range(axis, ends) { return axis.label + " " + digits(ends[0]) + " to " + digits(ends[1]) + unit(axis.unit); }
  var all = x === panel.x.range && y === panel.y.range;
  figure.said.textContent = all ? "" : "shown: " + range(panel.x, x) + ", " + range(panel.y, y);
  panel.view = { x: x, y: y };
  u.batch(function () {
    u.setScale("x", { min: x[0], max: x[1] });
    u.setScale("y", { min: y[0], max: y[1] });
  });
}

function pointOptions(figure, panel, holder) {
  function scale(key) {
    return { time: false, auto: false, distr: logarithmic(panel[key]) ? 3 : 1, range: function () { return panel.view[key]; } };
  }
  function room(names) {
    var longest = Math.max.apply(null, [0].concat((names || []).map(function (name) { return name.length; })));
    return Math.min(Math.max(7.5 * longest + 22, 58), 0.45 * holder.clientWidth);
  }
  function axis(key) {
    var at = panel[key].at;
    return {
      label: named(panel[key], key === "x" ? holder.clientWidth - room(panel.y.names) : panel.height), labelSize: 20, stroke: color("--ink"),
      size: key === "x" ? 32 : function (u, names) { return room(panel.y.names || names); },
      grid: { stroke: color("--rule"), width: 1 }, ticks: { stroke: color("--rule"), width: 1 },
      splits: function (u, index, low, high) {
        return at ? at.filter(function (place) { return place >= low && place <= high; }) : ticks(low, high, logarithmic(panel[key]), key === "x" && innerWidth < 600);
      },
      filter: function (u, splits) { return splits; },
      values: function (u, splits) { return at ? splits.map(function (place) { return panel[key].names[at.indexOf(place)]; }) : tickNames(splits); }
    };
  }
  return {
    width: Math.max(holder.clientWidth, 240), height: panel.height, padding: [panel.rules.length ? 22 : 10, 16, 0, 0],
    legend: { show: false }, series: [{}, { show: true, points: { show: false } }],
    axes: [axis("x"), axis("y")], scales: { x: scale("x"), y: scale("y") },
    cursor: {
      x: false, y: false, points: { show: false }, drag: { x: true, y: true, uni: 30, setScale: false },
      bind: { dblclick: function (u) { return function () { look(figure, u, panel, panel.x.range, panel.y.range); return null; }; } }
    },
    hooks: {
      draw: [drawPanel(panel), function (u) { if (choosesPoles(figure)) drawChosen(figure, u); }], setCursor: [hover(figure, panel)],
      setSelect: [function (u) {
        var box = u.select;
        if (box.width < 2 && box.height < 2) return;
        var x = [u.posToVal(box.left, "x"), u.posToVal(box.left + box.width, "x")];
        var y = [u.posToVal(box.top + box.height, "y"), u.posToVal(box.top, "y")];
        u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        look(figure, u, panel, x, y);
      }]
    }
  };
}

function key(panel) {
  var signs = { dot: "●", ring: "○", cross: "✕", square: "■", line: "―", curve: "―", band: "▮", bar: "▮" }, line = element("p", "key"), listed = {};
  panel.series.forEach(function (set) {
    if (!set.name || listed[set.name]) return;
    listed[set.name] = true;
    var sign = element("span", "", signs[set.mark] + " ");
    sign.style.color = "var(--" + set.color + ")";
    var entry = element("span", "", set.name);
    entry.insertBefore(sign, entry.firstChild);
    line.appendChild(entry);
  });
  return line;
}

function buildPoints(figure) {
  figure.panels.forEach(function (u) { u.destroy(); });
  figure.panels = [];
  figure.moves = null;
  figure.element.querySelectorAll(".chips .moving").forEach(function (button) { button.textContent = "move"; });
  figure.host.textContent = figure.said.textContent = "";
  figure.host.classList.add("points");
  figure.host.classList.toggle("square", figure.plot.kind === "circles");
  figure.host.classList.toggle("many", figure.plot.blocks[figure.shown].panels.length > 3);
  figure.panels = figure.plot.blocks[figure.shown].panels.map(function (panel) {
    var holder = element("div", "");
    if (panel.title) holder.appendChild(element("p", "head", panel.title));
    holder.appendChild(key(panel));
    figure.host.appendChild(holder);
    panel.view = { x: panel.x.range, y: panel.y.range };
    panel.swing = 1;
    panel.lit = null;
    var data = [panel.x.range.slice(), [null, null]];
    var u = new uPlot(pointOptions(figure, panel, holder), data, holder);
    panel.tip = element("div", "tip");
    u.over.appendChild(panel.tip);
    fingers(u, { x: panel.x.range, y: panel.y.range }, function (x, y) { look(figure, u, panel, x, y); });
    u.over.addEventListener("click", function () {
      // A point without an address has an empty one.
      var link = panel.lit && panel.lit.set.links && panel.lit.set.links[panel.lit.index];
      if (link) location.href = link;
    });
    if (choosesPoles(figure)) u.over.addEventListener("click", function () {
      if (!panel.lit || panel.lit.set.mark === "square") return;
      // One and a half per mille of what is shown is the width of a mark.
      togglePole(figure, panel.lit.set.x[panel.lit.index], 0.0015 * (panel.view.x[1] - panel.view.x[0]));
    });
    return u;
  });
  if (choosesPoles(figure)) showPoles(figure);
}

function pointChips(figure, chip) {
  var views = figure.plot.blocks;
  if (swings(figure)) chip("move", "view moving", function (button) { swing(figure, button); });
  chip("whole range", "reset", function () { buildPoints(figure); });
  if (views.length > 1) views.forEach(function (view, index) {
    chip(view.name, index === figure.shown ? "mode chosen" : "mode", function (button) {
      figure.shown = index;
      figure.element.querySelectorAll(".chips .chosen").forEach(function (other) { other.classList.remove("chosen"); });
      button.classList.add("chosen");
      buildPoints(figure);
    });
  });
}

// Two fingers zoom about their middle, one moves sideways; up and down stays with the page.
function fingers(u, whole, apply) {
  var over = u.over, down = {}, begin = null;
  function log(name) { return u.scales[name].distr === 3; }
  function into(name, value) { return log(name) ? Math.log10(value) : value; }
  function out(name, value) { return log(name) ? Math.pow(10, value) : value; }
  function state() {
    var all = Object.keys(down).map(function (id) { return down[id]; }), box = over.getBoundingClientRect();
    var n = all.length, x = 0, y = 0;
    all.forEach(function (at) { x += at[0] / n; y += at[1] / n; });
    var wide = n > 1 ? Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]) : 0;
    return { n: n, x: (x - box.left) / box.width, y: 1 - (y - box.top) / box.height, wide: Math.max(wide, 20) };
  }
  function restart() {
    begin = state();
    ["x", "y"].forEach(function (name) {
      var scale = u.scales[name];
      begin["of" + name] = [into(name, scale.min), into(name, scale.max)];
    });
  }
  function moved(name, now) {
    var from = begin["of" + name], ends = whole[name].map(function (end) { return into(name, end); });
    var zoomed = now.n > 1, width = Math.min((from[1] - from[0]) * (zoomed ? begin.wide / now.wide : 1), ends[1] - ends[0]);
    var low = from[0] + begin[name] * (from[1] - from[0]) - now[name] * width;
    low = Math.min(Math.max(low, ends[0]), ends[1] - width);
    return [out(name, low), out(name, low + width)];
  }
  function lifted(event) {
    if (!down[event.pointerId]) return;
    delete down[event.pointerId];
    restart();
  }
  over.style.touchAction = "pan-y";
  over.addEventListener("pointerdown", function (event) {
    if (event.pointerType !== "touch") return;
    down[event.pointerId] = [event.clientX, event.clientY];
    restart();
  });
  over.addEventListener("pointermove", function (event) {
    if (!down[event.pointerId]) return;
    down[event.pointerId] = [event.clientX, event.clientY];
    var now = state();
    apply(moved("x", now), whole.y && (now.n > 1 ? moved("y", now) : [u.scales.y.min, u.scales.y.max]));
  });
  ["pointerup", "pointercancel", "pointerleave"].forEach(function (name) { over.addEventListener(name, lifted); });
}
