//! The page in a browser: what it draws, that zoom and hover work, that nothing is asked for elsewhere.
//!
//! A headless Chromium opens a copy of the page to which a script is added that does what a reader would
//! do and writes down what came of it. Without a Chromium this test says so on standard error and passes.

use super::{samples, tapjoint};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Moves and drags the mouse over the first curves, and clicks a tap.
const VISITOR: &str = r#"
<script>
(function () {
  var seen = { errors: [] };
  addEventListener("error", function (event) { seen.errors.push(String(event.message)); });
  addEventListener("securitypolicyviolation", function (event) { seen.errors.push("fetch " + event.blockedURI); });
  function mouse(target, type, x, y) {
    var box = target.getBoundingClientRect();
    target.dispatchEvent(new MouseEvent(type, { bubbles: true, clientX: box.left + x, clientY: box.top + y, view: window, button: 0, movementX: 1, movementY: 1 }));
  }
  function finger(target, type, id, x, y) {
    var box = target.getBoundingClientRect();
    target.dispatchEvent(new PointerEvent(type, { bubbles: true, pointerId: id, pointerType: "touch", clientX: box.left + x, clientY: box.top + y }));
  }
  // Two fingers that part, or one that moves, as shares of the width.
  function touch(target, from, to) {
    var wide = target.clientWidth;
    from.forEach(function (x, id) { finger(target, "pointerdown", id + 1, x * wide, 40); });
    to.forEach(function (x, id) { finger(target, "pointermove", id + 1, x * wide, 40); });
    to.forEach(function (x, id) { finger(target, "pointerup", id + 1, x * wide, 40); });
  }
  // What the first point says that the pointer meets on its way over a panel of points.
  function met(figure, panel) {
    var over = figure.querySelectorAll(".u-over")[panel || 0], tip = over.querySelector(".tip");
    for (var y = 10; y < over.clientHeight; y += 20)
      for (var x = 5; x < over.clientWidth; x += 12) {
        mouse(over, "mousemove", x, y);
        met.x = x;
        met.y = y;
        if (tip.style.display === "block") return tip.textContent;
      }
    return "";
  }
  // Drags over the middle of a panel, or from one corner to the other, as shares of its sides.
  function drag(figure, panel, from, to) {
    var over = figure.querySelectorAll(".u-over")[panel || 0], wide = over.clientWidth, high = over.clientHeight;
    from = from || [0.1, 0.2];
    to = to || [0.9, 0.8];
    mouse(over, "mousedown", from[0] * wide, from[1] * high);
    mouse(over, "mousemove", to[0] * wide, to[1] * high);
    mouse(over, "mouseup", to[0] * wide, to[1] * high);
  }
  function words(figure) { return Array.from(figure.querySelectorAll(".u-legend .u-value")).map(function (v) { return v.textContent; }); }
  function wait(milliseconds) { return new Promise(function (done) { setTimeout(done, milliseconds); }); }
  // What is written on canvases from now on, and the numbers of taps, which stand in the middle of their place.
  var draw = CanvasRenderingContext2D.prototype.fillText;
  seen.written = {};
  seen.numbers = {};
  CanvasRenderingContext2D.prototype.fillText = function (words) {
    seen.written[words] = true;
    if (this.textBaseline === "middle" && this.textAlign === "center") seen.numbers[words] = true;
    return draw.apply(this, arguments);
  };
  function button(figure, name) {
    return Array.from(figure.querySelectorAll("button")).filter(function (one) { return one.textContent === name; })[0];
  }
  async function visit() {
    // The page unpacks its curves before they are drawn.
    for (var turn = 0; turn < 100 && !document.querySelector("figure.live"); turn++) await wait(50);
    await wait(200);
    var figures = document.querySelectorAll("figure.curves:not(.card)");
    seen.screen = {};
    [".state", ".card.value", ".card.cause", ".action", ".card.modes", ".card.chart"].forEach(function (part) {
      var found = document.querySelector(part);
      seen.screen[part] = found && found.getBoundingClientRect().bottom;
    });
    seen.figures = figures.length;
    seen.pictures = document.querySelectorAll("figure svg").length;
    seen.titles = Array.from(document.querySelectorAll("figure svg rect title")).map(function (title) { return title.textContent; });
    seen.live = document.querySelectorAll("figure.live canvas").length;
    seen.width = document.documentElement.scrollWidth;
    seen.window = innerWidth;
    seen.wide = Array.from(document.querySelectorAll("div.table .box")).filter(function (box) { return box.scrollWidth > box.clientWidth + 1; }).length;
    seen.background = getComputedStyle(document.body).backgroundColor;
    seen.resources = performance.getEntriesByType("resource").map(function (entry) { return entry.name; });
    var first = Array.from(figures).filter(function (figure) { return !figure.querySelector(".host.points"); })[0];
    var over = first.querySelector(".u-over");
    var wide = over.clientWidth;
    mouse(over, "mouseenter", 0.3 * wide, 40);
    mouse(over, "mousemove", 0.3 * wide, 40);
    await wait(100);
    seen.hover = words(first);
    mouse(over, "mousedown", 0.3 * wide, 40);
    mouse(over, "mousemove", 0.6 * wide, 40);
    mouse(over, "mouseup", 0.6 * wide, 40);
    await wait(100);
    mouse(over, "mousemove", 1, 40);
    await wait(100);
    seen.zoomed = words(first)[0];
    first.querySelector(".chips .reset").click();
    await wait(100);
    mouse(over, "mousemove", 1, 40);
    await wait(100);
    seen.reset = words(first)[0];
    touch(over, [0.4, 0.6], [0.2, 0.8]);
    await wait(100);
    mouse(over, "mousemove", 1, 40);
    await wait(100);
    seen.pinched = words(first)[0];
    touch(over, [0.5], [0.75]);
    await wait(100);
    mouse(over, "mousemove", 1, 40);
    await wait(100);
    seen.moved = words(first)[0];
    var points = Array.from(figures).filter(function (figure) { return figure.querySelector(".host.points"); });
    seen.points = [];
    for (var i = 0; i < points.length; i++) {
      var one = { met: met(points[i]), panels: points[i].querySelectorAll(".over, .u-over").length };
      one.last = met(points[i], one.panels - 1);
      drag(points[i]);
      await wait(100);
      one.zoomed = points[i].querySelector(".said").textContent;
      if (/probability/.test(one.last)) {
        drag(points[i], one.panels - 1, [0.02, 0.02], [0.5, 0.98]);
        await wait(100);
        one.left = met(points[i], one.panels - 1);
        one.tip = points[i].querySelectorAll(".tip")[one.panels - 1].getBoundingClientRect().left;
      }
      Array.from(points[i].querySelectorAll(".chips .mode")).slice(-1).forEach(function (chip) { chip.click(); });
      await wait(100);
      one.after = points[i].querySelector(".said").textContent;
      one.again = met(points[i]);
      seen.points.push(one);
    }
    var views = Array.from(figures).filter(function (figure) { return button(figure, "Nyquist"); })[0];
    button(views, "Nyquist").click();
    await wait(100);
    seen.circles = views.querySelectorAll(".host.square canvas").length;
    seen.circle = met(views);
    button(views, "real and imaginary").click();
    button(views, "log frequency").click();
    await wait(100);
    seen.parts = Array.from(views.querySelectorAll(".u-legend")).length;
    mouse(views.querySelector(".u-over"), "mousemove", 0.5 * views.querySelector(".u-over").clientWidth, 40);
    await wait(100);
    seen.middle = words(views)[0];
    var diagram = Array.from(figures).filter(function (figure) { return figure.querySelector(".poles code"); })[0];
    seen.poles = diagram.querySelector(".poles code").textContent;
    met(diagram);
    ["mousedown", "mouseup", "click"].forEach(function (type) { mouse(diagram.querySelector(".u-over"), type, met.x, met.y); });
    seen.fewer = diagram.querySelector(".poles code").textContent;
    var shapes = Array.from(figures).filter(function (figure) { return button(figure, "move"); })[0];
    button(shapes, "move").click();
    await wait(300);
    seen.moving = !!button(shapes, "stop");
    button(shapes, "stop").click();
    var taps = Array.from(figures).filter(function (figure) { return /● tap 1/.test(figure.textContent); })[0];
    Array.from(taps.querySelectorAll(".chips button")).filter(function (b) { return /tap 2/.test(b.textContent); })[0].click();
    seen.tap = taps.querySelector(".said").textContent;
    await wait(100);
    seen.near = taps.querySelectorAll(".near canvas").length;
    seen.nearest = Array.from(taps.querySelectorAll(".near .u-label")).map(function (label) { return label.textContent; });
    taps.querySelector(".chips .reset").click();
    await wait(100);
    var written = document.createElement("pre");
    written.id = "seen";
    written.textContent = JSON.stringify(seen);
    document.body.appendChild(written);
    if (parent !== window) parent.postMessage(written.textContent, "*");
  }
  visit().catch(function (problem) { seen.errors.push(String(problem)); document.body.insertAdjacentHTML("beforeend", "<pre id=seen></pre>"); document.getElementById("seen").textContent = JSON.stringify(seen); });
})();
</script>
"#;

/// A page that shows the report in a frame, because a browser's window has a least width.
const FRAME: &str = r#"<!DOCTYPE html><meta name="color-scheme" content="light dark"><body>
<iframe src="report.html" style="width: WIDTHpx; height: 900px; border: 0"></iframe>
<script>addEventListener("message", function (event) {
  var written = document.createElement("pre"); written.id = "seen"; written.textContent = event.data;
  document.body.appendChild(written);
});</script>"#;

/// A Chromium: the one that TAPJOINT_CHROMIUM names, or the first known name on the path.
pub fn chromium() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("TAPJOINT_CHROMIUM") {
        return Some(named.into());
    }
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let files = names
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let found = files.into_iter().find(|file| file.is_file());
    if found.is_none() {
        // Not by `eprintln!`: the test runner keeps what a passing test prints.
        let skipped =
            b"skipped: no Chromium on the path; install one or name it in TAPJOINT_CHROMIUM\n";
        std::io::stderr().write_all(skipped).unwrap();
    }
    found
}

/// What a visitor saw of the page, and what the browser complained of.
fn visited(chromium: &Path, page: &Path, width: u32, dark: bool) -> (Value, String) {
    let profile = tempfile::tempdir().unwrap();
    let framed = page.with_file_name("frame.html");
    std::fs::write(&framed, FRAME.replace("WIDTH", &width.to_string())).unwrap();
    let shown = if width < 500 { &framed } else { page };
    let scheme = if dark {
        "--blink-settings=preferredColorScheme=0"
    } else {
        "--blink-settings=preferredColorScheme=1"
    };
    let output = Command::new(chromium)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
        ])
        .args(["--virtual-time-budget=20000", "--dump-dom", scheme])
        .arg(format!("--window-size={width},900"))
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", shown.display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    let written = dom
        .split("<pre id=\"seen\">")
        .nth(1)
        .and_then(|rest| rest.split("</pre>").next());
    let written = written.unwrap_or_else(|| panic!("the visitor wrote nothing down: {error}"));
    let written = written
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    let console = error
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect::<Vec<_>>()
        .join("\n");
    (serde_json::from_str(&written).unwrap(), console)
}

/// The curves of a figure as the page holds them: JSON, deflated, in base 64.
pub(crate) fn unpacked(text: &str) -> Value {
    let bytes = BASE64_STANDARD.decode(text).unwrap();
    serde_json::from_reader(ZlibDecoder::new(bytes.as_slice())).unwrap()
}

fn packed(plot: &Value) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    serde_json::to_writer(&mut encoder, plot).unwrap();
    BASE64_STANDARD.encode(encoder.finish().unwrap())
}

/// The page with the spectra of the first recording ten thousand times smaller.
fn with_tiny_spectra(html: &str) -> String {
    const OPEN: &str = "<script type=\"text/plain\">";
    let texts = html.split(OPEN).skip(1);
    let texts = texts.map(|rest| rest.split_once("</script>").unwrap().0);
    let (text, mut plot) = texts
        .map(|text| (text, unpacked(text)))
        .find(|(_, plot)| plot["kind"] == "spectrum")
        .unwrap();
    for panel in plot["blocks"][0]["panels"].as_array_mut().unwrap() {
        for series in panel["series"].as_array_mut().unwrap() {
            for value in series["y"].as_array_mut().unwrap() {
                if let Some(number) = value.as_f64() {
                    *value = Value::from(1e-4 * number);
                }
            }
        }
    }
    html.replace(text, &packed(&plot))
}

/// The page of the sample with the visitor's script, in a folder of its own.
fn page_with_visitor() -> (tempfile::TempDir, PathBuf) {
    let folder = samples();
    tapjoint(
        folder.path(),
        &["run", "recordings/cantilever/test.toml", "--out", "report"],
        0,
    );
    let file = folder.path().join("report/report.html");
    let html = std::fs::read_to_string(&file).unwrap();
    let html = with_tiny_spectra(&html);
    let (head, tail) = html.rsplit_once("</body>").unwrap();
    std::fs::write(&file, format!("{head}{VISITOR}</body>{tail}")).unwrap();
    (folder, file)
}

fn number(words: &str) -> f64 {
    words
        .split_whitespace()
        .next()
        .unwrap_or_default()
        .parse()
        .unwrap_or(f64::NAN)
}

#[test]
fn regress_the_page_works_in_a_browser() {
    let Some(chromium) = chromium() else { return };
    let (_folder, page) = page_with_visitor();
    for (width, dark) in [(1280, false), (1280, true), (400, false), (400, true)] {
        let case = format!("{width} px, dark {dark}");
        let (seen, console) = visited(&chromium, &page, width, dark);
        assert_eq!(console, "", "{case}: the console complains");
        assert_eq!(seen["errors"], Value::Array(vec![]), "{case}");
        assert_eq!(
            seen["resources"],
            Value::Array(vec![]),
            "{case}: something was fetched"
        );
        // Of each of two recordings: spectra, responses, stabilisation, taps; the cloud, errors of the
        // frequencies, mode shapes, the gap and its places.
        assert_eq!(seen["figures"], 13, "{case}");
        assert!(seen["live"].as_u64() >= Some(10), "{case}: {seen}");
        assert!(seen["pictures"].as_u64() >= Some(11), "{case}: {seen}");
        assert!(
            seen["width"].as_u64() <= seen["window"].as_u64(),
            "{case}: scrolls sideways {seen}"
        );
        if width >= 1280 {
            assert_eq!(seen["wide"], 0, "{case}: tables scroll sideways");
            // State, joint, cause, action, modes and figure stand on a screen 800 pixels high.
            let first = seen["screen"].as_object().unwrap();
            assert!(first.len() == 6, "{case}: {first:?}");
            let ends = first.values().map(|end| end.as_f64().unwrap());
            assert!(
                ends.into_iter().all(|end| end > 0.0 && end < 800.0),
                "{case}: {first:?}"
            );
        }
        let light = seen["background"] == "rgb(255, 255, 255)";
        assert_eq!(light, !dark, "{case}: {}", seen["background"]);
        let hover: Vec<&str> = seen["hover"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(Value::as_str)
            .collect();
        assert!(
            hover[0].ends_with(" Hz") && hover[1].ends_with(" m/s² s"),
            "{case}: {hover:?}"
        );
        // The band is 0 to 200 Hz; dragged over was the part from 30 to 60 %.
        assert!(
            (number(hover[0]) - 60.0).abs() < 4.0,
            "{case}: hover at {hover:?}"
        );
        let zoomed = number(seen["zoomed"].as_str().unwrap());
        assert!(
            (zoomed - 60.0).abs() < 4.0,
            "{case}: zoomed view begins at {zoomed}"
        );
        let reset = number(seen["reset"].as_str().unwrap());
        assert!(reset < 2.0, "{case}: the whole view begins at {reset}");
        // Two fingers that part to three times their distance leave a third of 200 Hz about its middle.
        let pinched = number(seen["pinched"].as_str().unwrap());
        assert!((pinched - 66.7).abs() < 2.0, "{case}: pinched to {pinched}");
        // A finger that moves by a quarter of the width takes a quarter of that third along.
        let moved = number(seen["moved"].as_str().unwrap());
        assert!((moved - 50.0).abs() < 2.0, "{case}: moved to {moved}");
        points_answer(&seen["points"], &case);
        views_answer(&seen, &case);
        titles_say_values(&seen["titles"], &case);
        assert!(
            seen["tap"].as_str().unwrap().starts_with("tap 2: used, "),
            "{case}: {}",
            seen["tap"]
        );
        assert_eq!(
            seen["near"], 2,
            "{case}: the force's samples and the response's"
        );
        axes_have_one_style(&seen["written"], &case);
        for number in ["1", "5"] {
            assert_eq!(seen["numbers"][number], true, "{case}: {}", seen["numbers"]);
        }
    }
}

/// Ticks are written with powers of ten or plainly, never as a computer does.
fn axes_have_one_style(written: &Value, case: &str) {
    let words: Vec<&String> = written.as_object().unwrap().keys().collect();
    let powers = words.iter().filter(|words| words.starts_with("10\u{207b}"));
    assert!(powers.count() > 1, "{case}: {words:?}");
    let tiny = |words: &&&String| words.contains("e\u{2212}") || words.contains("e-");
    assert_eq!(words.iter().find(tiny), None, "{case}");
}

/// What the figures of points say of a point, by what they show, and how many there are.
const ANSWERS: [(&str, usize, &[&str]); 6] = [
    ("order ", 2, &["frequency ", " Hz", "damping ", " %"]),
    ("Kx ", 1, &["Ky "]),
    (
        "used in the estimate, mode ",
        1,
        &["measured ", "predicted ", " Hz", "error ", " ± ", " %"],
    ),
    ("mode shape · ", 1, &["position ", " mm", "displacement "]),
    (
        "exactly as described, joint fitted, mode ",
        1,
        &[
            " in ",
            "error of the frequency ",
            " %",
            " standard deviations",
        ],
    ),
    (
        "position from the joint ",
        1,
        &[" mm", "misfit explained ", " %"],
    ),
];

/// Functions of the low recording as circles and parts, poles chosen by hand, and shapes in motion.
fn views_answer(seen: &Value, case: &str) {
    // A circle for each of the two modes.
    assert_eq!(seen["circles"], 2, "{case}");
    let circle = seen["circle"].as_str().unwrap();
    assert!(
        circle.contains(" Hz") && circle.contains("real part"),
        "{case}: {circle}"
    );
    assert_eq!(seen["parts"], 2, "{case}: real and imaginary part");
    // The middle of a logarithmic axis from the first line above 0 Hz to 200 Hz.
    let middle = number(seen["middle"].as_str().unwrap());
    assert!((5.0..40.0).contains(&middle), "{case}: {middle}");
    let [poles, fewer] = ["poles", "fewer"].map(|key| seen[key].as_str().unwrap());
    assert_eq!(
        poles, "poles = [16.55239, 116.7578, 330.8602, 620.4509, 975.6601]",
        "{case}"
    );
    assert_eq!(
        poles.matches(',').count(),
        fewer.matches(',').count() + 1,
        "{case}: {fewer}"
    );
    assert_eq!(seen["moving"], true, "{case}");
}

/// Every figure of points says what a point is, and zooms in both directions; diagrams change views.
fn points_answer(points: &Value, case: &str) {
    let points = points.as_array().unwrap();
    let words = |figure: &Value, key: &str| figure[key].as_str().unwrap().to_owned();
    for (name, count, parts) in ANSWERS {
        let shown: Vec<&Value> = points
            .iter()
            .filter(|figure| words(figure, "met").contains(name))
            .collect();
        assert_eq!(shown.len(), count, "{case}: {name}: {points:?}");
        for figure in shown {
            let said = words(figure, "met");
            assert!(
                parts.iter().all(|part| said.contains(part)),
                "{case}: {said}"
            );
            assert!(
                words(figure, "zoomed").starts_with("shown: "),
                "{case}: {figure}"
            );
            if name == "order " {
                assert!(
                    words(figure, "again").contains("order "),
                    "{case}: {figure}"
                );
                assert_eq!(words(figure, "after"), "", "{case}: another view is whole");
            }
        }
    }
    // The gap's second panel has the hypotheses.
    let odds = points.iter().map(|figure| words(figure, "last"));
    let odds: Vec<String> = odds.filter(|said| said.contains("probability ")).collect();
    assert_eq!(odds.len(), 1, "{case}: {points:?}");
    let leader = "found, sensor-mass · probability 92.";
    assert!(odds[0].starts_with(leader), "{case}: {odds:?}");
    // Zoomed to its left half the panel still has the bar that ends beyond it, and says so within the page.
    let zoomed = points.iter().find(|figure| figure["left"].is_string());
    let zoomed = zoomed.unwrap_or_else(|| panic!("{case}: {points:?}"));
    assert!(
        words(zoomed, "left").starts_with(leader),
        "{case}: {zoomed}"
    );
    let tip = zoomed["tip"].as_f64().unwrap();
    assert!((0.0..1280.0).contains(&tip), "{case}: {zoomed}");
}

/// Without a script the pictures of the model say the same as titles.
fn titles_say_values(titles: &Value, case: &str) {
    let titles: Vec<&str> = titles
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    let kinds: [&[&str]; 7] = [
        &[
            "mode used in the estimate, mode 1, measured 16.55",
            " Hz, predicted ",
            " \u{b7} error 0.",
            " \u{b1} ",
            " %",
        ],
        &["mode shape \u{b7} position ", " mm", " of its largest"],
        &[
            "sensor, A: mode 1 \u{b7} position 338 mm \u{b7} displacement 0.7",
            " predicted",
        ],
        &["measured, sensor B \u{b7} position 205 mm \u{b7} displacement 0.391 \u{b1} 0.001"],
        &[
            "with sensor-mass, mode 2 in low.wav \u{b7} error of the frequency ",
            " % \u{b7} that is ",
            " standard deviations",
        ],
        &["found, sensor-mass \u{b7} probability 92.", " %"],
        &[
            "bending stiffness \u{b7} position from the joint ",
            " mm \u{b7} local change ",
            " \u{b1} ",
            " %",
        ],
    ];
    for parts in kinds {
        let says = |title: &&str| parts.iter().all(|part| title.contains(part));
        assert!(titles.iter().any(says), "{case}: {parts:?} in {titles:?}");
    }
}

/// Writes down which figures are live, and with which view they open.
const COUNTER: &str = r#"<script>
setTimeout(function () {
  var seen = document.createElement("pre"), chosen = Array.from(document.querySelectorAll(".chips .chosen"));
  seen.id = "seen";
  seen.textContent = JSON.stringify({
    live: document.querySelectorAll("figure.live").length,
    drawn: document.querySelectorAll("figure.live canvas").length,
    chosen: chosen.map(function (button) { return button.textContent; })
  });
  document.body.appendChild(seen);
}, 3000);
</script>"#;

#[test]
fn regress_the_page_of_a_comparison_works_in_a_browser() {
    let Some(chromium) = chromium() else { return };
    let folder = samples();
    let test = "recordings/cantilever/test.toml";
    tapjoint(
        folder.path(),
        &["compare", test, test, "--out", "report"],
        0,
    );
    let page = folder.path().join("report/report.html");
    let html = std::fs::read_to_string(&page).unwrap();
    let (head, tail) = html.rsplit_once("</body>").unwrap();
    std::fs::write(&page, format!("{head}{COUNTER}</body>{tail}")).unwrap();
    for dark in [false, true] {
        let (seen, console) = visited(&chromium, &page, 1280, dark);
        assert_eq!(console, "", "dark {dark}: the console complains");
        assert_eq!(seen["live"], 2, "{seen}");
        // Changes and causes, and a close-up of each of the modes.
        assert!(seen["drawn"].as_u64() >= Some(5), "{seen}");
        assert_eq!(seen["chosen"], serde_json::json!(["Close-ups"]), "{seen}");
    }
}

/// Pages of a PDF, which Chromium lists without compression.
fn pages(pdf: &[u8]) -> usize {
    let words = String::from_utf8_lossy(pdf);
    words.matches("/Type /Page\n").count()
}

#[test]
fn regress_two_figures_share_a_printed_page() {
    let Some(chromium) = chromium() else { return };
    let folder = samples();
    let test = "recordings/cantilever/test.toml";
    tapjoint(folder.path(), &["run", test, "--out", "report"], 0);
    let page = folder.path().join("report/report.html");
    let printed = |html: &str| {
        std::fs::write(&page, html).unwrap();
        let profile = tempfile::tempdir().unwrap();
        let pdf = folder.path().join("report.pdf");
        let status = Command::new(&chromium)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu"])
            .args(["--no-pdf-header-footer", "--virtual-time-budget=20000"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("--print-to-pdf={}", pdf.display()))
            .arg(format!("file://{}", page.display()))
            .output()
            .unwrap();
        assert!(status.status.success());
        pages(&std::fs::read(pdf).unwrap())
    };
    let html = std::fs::read_to_string(&page).unwrap();
    let (head, tail) = html.split_once("max-height: 116mm").unwrap();
    let (shared, alone) = (printed(&html), printed(&format!("{head}{tail}")));
    assert!(
        shared > 2 && shared < alone,
        "{shared} pages, {alone} without"
    );
}

#[test]
fn prop_the_page_of_a_test_stays_small() {
    let folder = samples();
    tapjoint(
        folder.path(),
        &["run", "recordings/cantilever/test.toml", "--out", "report"],
        0,
    );
    let size = std::fs::metadata(folder.path().join("report/report.html"))
        .unwrap()
        .len();
    // Two recordings; five have to stay below 2 MB.
    assert!(size < 800_000, "{size} bytes");
}
