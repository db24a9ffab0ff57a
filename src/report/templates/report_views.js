// Other views of frequency response functions, made of their magnitudes and phases: real and imaginary part, and
// the circle of each mode (Nyquist). And mode shapes in motion.

var circleShare = 0.12; // a mode's circle ends where the magnitude falls below this share of its peak
var circlesAtOnce = 12;

function isPhase(panel) { return panel.y.period === 360; }

// The functions of a plot as complex numbers, where all lines are drawn: of thinned ones magnitude and phase are those of
// different lines. None where magnitudes have several units, whose order the phases do not tell.
function complexCurves(plot) {
  var panels = plot.blocks[0].panels, phase = panels.filter(isPhase)[0];
  var sized = panels.slice(0, panels.indexOf(phase));
  if (!phase || sized.length !== 1) return [];
  var runs = phase.series[0].x, step = Math.min.apply(null, runs.map(function (run) { return run.step; })), whole = [];
  runs.forEach(function (run) { for (var i = 0; i < run.count; i++) whole.push(run.step < 1.001 * step); });
  return phase.series.map(function (angles, at) {
    var sizes = sized[0].series[at], re = [], im = [];
    angles.y.forEach(function (degrees, i) {
      var size = sizes.y[i], turn = degrees * Math.PI / 180, known = whole[i] && size != null && degrees != null;
      re.push(known ? size * Math.cos(turn) : null);
      im.push(known ? size * Math.sin(turn) : null);
    });
    return { name: sizes.name, color: angles.color, mark: angles.mark, size: angles.size, opacity: 1, x: angles.x, re: re, im: im };
  });
}

function cartesian(plot, functions) {
  var first = plot.blocks[0].panels[0];
  var panels = [["real part", "re"], ["imaginary part", "im"]].map(function (part) {
    return {
      title: "", height: 280, x: first.x, rules: first.rules, events: [], note: first.note,
      y: { label: part[0], unit: first.y.unit, scale: "linear", fits: true },
      series: functions.map(function (one) { return Object.assign({}, one, { y: one[part[1]] }); })
    };
  });
  return { kind: "frf", blocks: [{ name: "", panels: panels }] };
}

// The lines about a mode down to a share of its peak.
function about(one, frequencies, at) {
  var size = function (i) { return one.re[i] == null ? -1 : Math.hypot(one.re[i], one.im[i]); };
  var peak = 0;
  frequencies.forEach(function (f, i) { if (Math.abs(f - at) < Math.abs(frequencies[peak] - at)) peak = i; });
  for (var next = peak; ; peak = next) {
    if (size(peak - 1) > size(next)) next = peak - 1;
    if (size(peak + 1) > size(next)) next = peak + 1;
    if (next === peak) break;
  }
  var low = peak, high = peak, least = circleShare * size(peak);
  while (size(low - 1) >= least) low--;
  while (size(high + 1) >= least) high++;
  return [low, high + 1];
}

function circle(mode, functions, frequencies, unitWords) {
  var most = 0, at = frequencies[0];
  var series = functions.map(function (one) {
    var ends = about(one, frequencies, mode.at), part = function (values) { return values.slice(ends[0], ends[1]); };
    var fitted = one.color === "ink", set = { name: one.name, color: one.color, mark: fitted ? "line" : "dot", size: fitted ? 1.2 : 3, opacity: 1, x: part(one.re), y: part(one.im) };
    set.words = part(frequencies).map(function (f) { return +f.toPrecision(7) + " Hz"; });
    set.x.concat(set.y).forEach(function (value) { most = Math.max(most, Math.abs(value)); });
    return set;
  });
  var axis = function (label) { return { label: label, unit: unitWords, scale: "linear", low: -1.08 * most, high: 1.08 * most, range: [-1.08 * most, 1.08 * most] }; };
  return { title: mode.name + ", " + mode.words, height: 352, x: axis("real part"), y: axis("imaginary part"), series: series, rules: [], events: [], note: "" };
}

function circles(plot, functions) {
  var first = plot.blocks[0].panels[0], frequencies = places(functions[0].x), blocks = [];
  var modes = first.rules.filter(function (rule) { return rule.mode; });
  for (var from = 0; from < modes.length; from += circlesAtOnce) {
    var some = modes.slice(from, from + circlesAtOnce);
    blocks.push({
      name: some[0].name + " to " + some[some.length - 1].name,
      panels: some.map(function (mode) { return circle(mode, functions, frequencies, first.y.unit); })
    });
  }
  return blocks.length ? { kind: "circles", blocks: blocks } : null;
}

// The views that a figure can change to, by their names.
function viewsOf(plot) {
  if (plot.kind !== "frf") return [];
  var functions = complexCurves(plot);
  if (!functions.length) return [];
  var views = [["magnitude and phase", plot], ["real and imaginary", cartesian(plot, functions)], ["Nyquist", circles(plot, functions)]];
  return views.filter(function (view) { return view[1]; });
}

// Shapes swing together, once in two seconds, each by the cosine of the same time.
function swings(figure) { return figure.plot.kind === "mode-shapes"; }

function swing(figure, button) {
  figure.moves = figure.moves ? null : {};
  button.textContent = figure.moves ? "stop" : "move";
  var begin = performance.now(), own = figure.moves;
  function step(now) {
    // A later click has begun another motion, or another view has come.
    if (figure.moves !== own) return;
    figure.panels.forEach(function (u, index) {
      figure.plot.blocks[figure.shown].panels[index].swing = own ? Math.cos(Math.PI * (now - begin) / 1000) : 1;
      u.redraw(false);
    });
    if (own) requestAnimationFrame(step);
  }
  requestAnimationFrame(step);
}

// Poles chosen by hand in a stabilisation diagram, as the line that a test description takes.
function choosesPoles(figure) { return figure.plot.kind === "stabilisation"; }

var sameShare = 2e-3; // poles of two recordings within this share are one

function poleWords(frequency) { return String(+frequency.toPrecision(7)); }

// The modes that the program selected are chosen to begin with.
function startPoles(figure) {
  figure.poles = {};
  figure.plot.blocks[0].panels[0].rules.forEach(function (rule) {
    if (rule.mode) figure.poles[poleWords(rule.at)] = { at: rule.at, mode: rule.name };
  });
}

function chosenPoles(figure) {
  return Object.keys(figure.poles).map(function (key) { return figure.poles[key]; });
}

// The poles of all recordings, each mode once; null where a mode lies elsewhere in another recording.
function commonPoles() {
  var found = [], alike = true;
  all.filter(choosesPoles).forEach(function (one) {
    chosenPoles(one).forEach(function (pole) {
      var known = found.filter(function (other) { return pole.mode ? other.mode === pole.mode : Math.abs(other.at - pole.at) < sameShare * pole.at; })[0];
      if (!known) found.push(pole);
      else if (Math.abs(known.at - pole.at) > sameShare * pole.at) alike = false;
    });
  });
  return alike ? found : null;
}

// A click on a pole chooses it; a click on one that is chosen, or beside it, leaves it out.
function togglePole(figure, frequency, near) {
  var close = chosenPoles(figure).filter(function (other) { return Math.abs(other.at - frequency) <= near; });
  // A mode that is left out is left out of all recordings.
  if (close.length) all.filter(choosesPoles).forEach(function (one) {
    chosenPoles(one).forEach(function (pole) {
      var gone = close.some(function (other) { return other === pole || pole.mode && other.mode === pole.mode; });
      if (gone) delete one.poles[poleWords(pole.at)];
    });
  });
  else figure.poles[poleWords(frequency)] = { at: frequency };
  all.filter(choosesPoles).forEach(showPoles);
}

function showPoles(figure) {
  var common = commonPoles(), table = common ? "[analysis]" : "the [[recording]] of this recording";
  var places = (common || chosenPoles(figure)).map(function (pole) { return pole.at; }).sort(function (a, b) { return a - b; });
  figure.poleLine.textContent = "Click poles to choose modes by hand, then write this line under " + table + " of the description: ";
  figure.poleLine.appendChild(element("code", "", "poles = [" + places.map(poleWords).join(", ") + "]"));
  figure.panels.forEach(function (u) { u.redraw(false); });
}

function drawChosen(figure, u) {
  var c = u.ctx, box = u.bbox, ratio = devicePixelRatio || 1;
  c.save();
  c.beginPath(); c.rect(box.left, box.top, box.width, box.height); c.clip();
  c.strokeStyle = c.fillStyle = color("--ink");
  c.lineWidth = 1.6 * ratio;
  chosenPoles(figure).forEach(function (pole) {
    var x = u.valToPos(pole.at, "x", true), y = box.top + 7 * ratio;
    c.beginPath(); c.moveTo(x - 5 * ratio, y - 6 * ratio); c.lineTo(x + 5 * ratio, y - 6 * ratio); c.lineTo(x, y + 3 * ratio); c.closePath(); c.fill();
  });
  c.restore();
}
