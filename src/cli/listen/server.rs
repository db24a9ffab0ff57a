//! The live page: served to this machine alone, to whoever knows the token in its address.

use super::bench::{Action, Bench};
use super::views::View;
use crate::report::joined;
use anyhow::anyhow;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;
use tiny_http::{Header, Method, Request, Response, Server};

const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");

/// Pages that are kept up to date at once; more are refused. Each takes a thread.
const MOST_PAGES: usize = 8;
/// Requests that are answered at once. One that does not come to its end takes a thread.
const MOST_REQUESTS: usize = 64;
/// Longest body of a request (bytes). Those of the page take less than 100.
const LONGEST_BODY: u64 = 1000;
/// Taps that the page shows. Older ones are counted.
const MOST_TAPS: usize = 100;
/// After this time without news a connection is tried: one that has gone is found so.
const QUIET: Duration = Duration::from_secs(10);
/// What the page may load: its own files, and a report without scripts.
const POLICY: &str = "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; frame-src 'self'; \
                      img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
/// The same of the report in the page.
const REPORT_POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'; sandbox";

/// The page as a view.
pub(super) struct Page {
    address: String,
    shared: Arc<Shared>,
    actions: Receiver<Action>,
    /// What was shown last.
    report: Option<String>,
    reports: u64,
}

/// What the threads of the server share.
struct Shared {
    token: String,
    port: u16,
    news: Mutex<News>,
    has_news: Condvar,
    pages: AtomicUsize,
    requests: AtomicUsize,
    actions: Sender<Action>,
}

/// What the page shows.
#[derive(Default)]
struct News {
    /// The bench as JSON, and how often it has changed.
    bench: String,
    benches: u64,
    /// Time and movement of the channels as JSON, and how often they have changed.
    pulse: String,
    pulses: u64,
    /// The first screen of a report.
    report: String,
    is_over: bool,
}

impl Shared {
    fn news(&self) -> MutexGuard<'_, News> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Page {
    /// Serves the page on a port of this machine; 0 = any free one.
    ///
    /// # Errors
    /// The port is taken, or the system gives no random token.
    pub(super) fn serve(port: u16) -> anyhow::Result<Self> {
        let server = Server::http(("127.0.0.1", port)).map_err(|cause| {
            anyhow!("--serve {port}: this port cannot be used: {cause}; give another one, or 0 for any free one")
        })?;
        let port = server
            .server_addr()
            .to_ip()
            .map_or(port, |address| address.port());
        let token = format!("{:032x}", rand::random::<u128>());
        let address = format!("http://127.0.0.1:{port}/{token}/");
        let (sender, actions) = channel();
        let shared = Arc::new(Shared {
            token,
            port,
            news: Mutex::default(),
            has_news: Condvar::new(),
            pages: AtomicUsize::new(0),
            requests: AtomicUsize::new(0),
            actions: sender,
        });
        let own = shared.clone();
        thread::spawn(move || {
            for request in server.incoming_requests() {
                while own.requests.load(Ordering::Relaxed) >= MOST_REQUESTS {
                    thread::sleep(Duration::from_millis(10));
                }
                own.requests.fetch_add(1, Ordering::Relaxed);
                let own = own.clone();
                thread::spawn(move || {
                    answer(request, &own);
                    own.requests.fetch_sub(1, Ordering::Relaxed);
                });
            }
        });
        Ok(Self {
            address,
            shared,
            actions,
            report: None,
            reports: 0,
        })
    }

    /// Address of the page, with its token.
    pub(super) fn address(&self) -> &str {
        &self.address
    }
}

impl View for Page {
    fn show(&mut self, bench: &Bench) -> io::Result<()> {
        if self.report != bench.first_screen {
            self.report.clone_from(&bench.first_screen);
            self.reports += 1;
        }
        let reports = if self.report.is_some() {
            self.reports
        } else {
            0
        };
        let (told, pulse) = (told(bench, reports).to_string(), pulse(bench).to_string());
        let mut news = self.shared.news();
        if news.bench != told {
            news.bench = told;
            news.benches += 1;
            news.report = self.report.clone().unwrap_or_default();
        }
        if news.pulse != pulse {
            news.pulse = pulse;
            news.pulses += 1;
        }
        drop(news);
        self.shared.has_news.notify_all();
        Ok(())
    }

    fn actions(&mut self, _bench: &Bench) -> Vec<Action> {
        self.actions.try_iter().collect()
    }

    fn shows_report(&self) -> bool {
        true
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.shared.news().is_over = true;
        self.shared.has_news.notify_all();
        // The last words are on their way, for two seconds at most.
        for _ in 0..200 {
            if self.shared.pages.load(Ordering::Relaxed) == 0 {
                break;
            }
            thread::sleep(Duration::from_millis(10));
        }
    }
}

/// The bench for the page: times in s.
fn told(bench: &Bench, reports: u64) -> Value {
    let left_out = bench.taps.len().saturating_sub(MOST_TAPS);
    let taps = bench.taps.iter().skip(left_out).map(|tap| {
        json!({
            "time": tap.time,
            "accepted": tap.rejection.is_none(),
            "overruled": tap.overruled.is_some(),
            "words": joined(&tap.to_string()),
        })
    });
    json!({
        "title": bench.title,
        "advice": joined(&bench.advice),
        "is_enough": bench.is_enough,
        "taps": taps.collect::<Vec<_>>(),
        "left_out": left_out,
        "result": all_joined(bench.result.iter()),
        "result_head": if bench.is_result_old { "Earlier result" } else { "So far" },
        "precision": joined(&bench.precision),
        "report": reports,
        "notes": all_joined(bench.notes.iter()),
        "next": bench.next.as_deref().map(joined),
        "ended": bench.ended,
    })
}

fn all_joined<'a>(texts: impl Iterator<Item = &'a String>) -> Vec<String> {
    texts.map(|text| joined(text)).collect()
}

/// Time and movement of the channels for the page.
fn pulse(bench: &Bench) -> Value {
    let levels = bench.levels.iter();
    let levels = levels.map(|level| json!({ "name": level.name, "recent": level.heights() }));
    json!({ "seconds": bench.seconds, "levels": levels.collect::<Vec<_>>() })
}

/// Answers a request. One that comes from elsewhere, or without the token, learns nothing.
fn answer(mut request: Request, shared: &Arc<Shared>) {
    let Some(path) = permitted(&request, shared) else {
        let _ = request.respond(plain(
            403,
            "The address is not complete, or it belongs to another recording: copy all of it.",
        ));
        return;
    };
    let path = path.split('?').next().unwrap_or_default().to_owned();
    let is_post = *request.method() == Method::Post;
    if !is_post && *request.method() != Method::Get {
        let _ = request.respond(plain(405, "GET or POST only."));
        return;
    }
    let response = match (is_post, path.as_str()) {
        (false, "") => file(PAGE, "text/html; charset=utf-8", POLICY),
        (false, "page.css") => file(STYLE, "text/css; charset=utf-8", POLICY),
        (false, "page.js") => file(SCRIPT, "text/javascript; charset=utf-8", POLICY),
        (false, "report") => file(
            &shared.news().report,
            "text/html; charset=utf-8",
            REPORT_POLICY,
        ),
        (false, "events") => return send_events(request, shared),
        (true, "act") => match action_in(&mut request) {
            Some(action) => {
                // The recording may have ended.
                let _ = shared.actions.send(action);
                plain(204, "")
            }
            None => plain(400, "No such action."),
        },
        _ => plain(404, "There is nothing here."),
    };
    let _ = request.respond(response);
}

/// Returns the path of a request behind the token; `None` of one that this page did not make.
fn permitted(request: &Request, shared: &Shared) -> Option<String> {
    let header = |name: &str| {
        let headers = request.headers().iter();
        let mut found =
            headers.filter(|header| header.field.as_str().as_str().eq_ignore_ascii_case(name));
        found.next().map(|header| header.value.as_str().to_owned())
    };
    let names = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", shared.port));
    let host = header("Host")?;
    // The usual port of a page is left out.
    let is_usual = shared.port == 80 && ["127.0.0.1", "localhost"].contains(&host.as_str());
    if !is_usual && !names.contains(&host) {
        return None;
    }
    // Of a browser; other programs of this user need the token alone.
    if header("Origin").is_some_and(|origin| origin != format!("http://{host}")) {
        return None;
    }
    let is_json = header("Content-Type").is_some_and(|kind| kind.starts_with("application/json"));
    if *request.method() == Method::Post && !is_json {
        return None;
    }
    let (token, path) = request.url().strip_prefix('/')?.split_once('/')?;
    // As long for a token that is nearly right as for any other.
    let differs = token.len() ^ shared.token.len();
    let bytes = token.bytes().zip(shared.token.bytes());
    let differs = bytes.fold(differs, |differs, (one, other)| {
        differs | usize::from(one ^ other)
    });
    (differs == 0).then(|| path.to_owned())
}

/// Returns what the body of a request asks for.
fn action_in(request: &mut Request) -> Option<Action> {
    let mut body = Vec::new();
    let reader = request.as_reader();
    reader.take(LONGEST_BODY + 1).read_to_end(&mut body).ok()?;
    action_of(&body)
}

/// Returns what a body asks for: `{"action": "accept", "time": 4.91}`.
fn action_of(body: &[u8]) -> Option<Action> {
    if body.len() as u64 > LONGEST_BODY {
        return None;
    }
    let asked: Value = serde_json::from_slice(body).ok()?;
    let time = match asked.get("time") {
        None | Some(Value::Null) => None,
        Some(time) => Some(time.as_f64()?),
    };
    match asked.get("action")?.as_str()? {
        "accept" => Some(Action::Accept(time)),
        "reject" => Some(Action::Reject(time)),
        "undo" => Some(Action::Undo),
        "next" => Some(Action::Next),
        "stop" => Some(Action::Stop),
        _ => None,
    }
}

/// Sends news to a page until it is closed, or the program ends.
fn send_events(request: Request, shared: &Arc<Shared>) {
    if shared.pages.fetch_add(1, Ordering::Relaxed) >= MOST_PAGES {
        shared.pages.fetch_sub(1, Ordering::Relaxed);
        let _ = request.respond(plain(503, "Too many pages are open."));
        return;
    }
    let shared = shared.clone();
    thread::spawn(move || {
        // The reader of the page may have gone.
        let _ = write_events(request.into_writer(), &shared);
        shared.pages.fetch_sub(1, Ordering::Relaxed);
    });
}

fn write_events(mut page: Box<dyn Write + Send>, shared: &Shared) -> io::Result<()> {
    page.write_all(
        b"HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n\
          X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
    )?;
    page.flush()?;
    let (mut benches, mut pulses) = (0, 0);
    loop {
        let mut events = String::new();
        let mut news = shared.news();
        if news.benches == benches && news.pulses == pulses && !news.is_over {
            let waited = shared.has_news.wait_timeout(news, QUIET);
            news = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        // JSON has no line breaks outside of strings, and escapes those within.
        if news.benches != benches {
            let _ = write!(events, "event: bench\ndata: {}\n\n", news.bench);
        }
        if news.pulses != pulses {
            let _ = write!(events, "event: pulse\ndata: {}\n\n", news.pulse);
        }
        (benches, pulses) = (news.benches, news.pulses);
        let is_over = news.is_over;
        drop(news);
        if events.is_empty() {
            events.push_str(": still here\n\n");
        }
        page.write_all(events.as_bytes())?;
        page.flush()?;
        if is_over {
            return Ok(());
        }
    }
}

/// A file of the page.
fn file(text: &str, kind: &str, policy: &str) -> Response<io::Cursor<Vec<u8>>> {
    let mut response = Response::from_data(text.as_bytes().to_vec());
    for (name, value) in [
        ("Content-Type", kind),
        ("Content-Security-Policy", policy),
        ("X-Content-Type-Options", "nosniff"),
        // The address holds the token.
        ("Referrer-Policy", "no-referrer"),
        ("Cache-Control", "no-store"),
    ] {
        if let Ok(header) = Header::from_bytes(name, value) {
            response.add_header(header);
        }
    }
    response
}

/// An answer of one line.
fn plain(status: u16, text: &str) -> Response<io::Cursor<Vec<u8>>> {
    file(text, "text/plain; charset=utf-8", POLICY).with_status_code(status)
}
