//! The ways in which the bench is shown: lines, a live screen, a page.

use super::super::terminal::Terminal;
use super::bench::{Action, Bench};
use std::io;
use std::time::{Duration, Instant};

/// Time between two pictures of a live view: ten in a second look steady.
const BETWEEN: Duration = Duration::from_millis(100);

/// A live view.
pub(super) trait View {
    /// Shows the bench.
    ///
    /// # Errors
    /// The view is gone.
    fn show(&mut self, bench: &Bench) -> io::Result<()>;

    /// Returns what was asked for since the last call.
    fn actions(&mut self, bench: &Bench) -> Vec<Action>;

    /// Returns true of a view in the place where lines would be printed.
    fn hides_lines(&self) -> bool {
        false
    }

    /// Returns true of a view that shows the first screen of a report.
    fn shows_report(&self) -> bool {
        false
    }
}

/// All views of one bench.
pub(super) struct Views<'a> {
    terminal: &'a Terminal,
    live: Vec<Box<dyn View>>,
    /// Lines that a live screen hides. They are printed once it has gone.
    hidden: Vec<Line>,
    shown: Option<Instant>,
    /// What is shown.
    pub(super) bench: Bench,
}

enum Line {
    Said(String),
    Warned(String),
}

impl<'a> Views<'a> {
    pub(super) fn new(terminal: &'a Terminal) -> Self {
        Self {
            terminal,
            live: Vec::new(),
            hidden: Vec::new(),
            shown: None,
            bench: Bench::default(),
        }
    }

    /// Adds a view.
    #[cfg_attr(
        not(any(feature = "screen", feature = "serve")),
        expect(dead_code, reason = "there are lines alone")
    )]
    pub(super) fn add(&mut self, view: Box<dyn View>) {
        self.live.push(view);
    }

    /// Begins with a recording of this title.
    pub(super) fn begin(&mut self, title: String) {
        self.bench = Bench {
            title,
            notes: std::mem::take(&mut self.bench.notes),
            address: self.bench.address.take(),
            ..Bench::default()
        };
    }

    /// The terminal that the lines are printed on.
    pub(super) fn terminal(&self) -> &'a Terminal {
        self.terminal
    }

    fn hides_lines(&self) -> bool {
        self.live.iter().any(|view| view.hides_lines())
    }

    /// Returns true where there is a view with keys or buttons.
    pub(super) fn are_live(&self) -> bool {
        !self.live.is_empty()
    }

    /// Returns true where a view shows the first screen of a report.
    pub(super) fn shows_report(&self) -> bool {
        self.live.iter().any(|view| view.shows_report())
    }

    /// Prints an answer. The recording goes on where standard output was closed.
    pub(super) fn say(&mut self, text: &str) {
        match self.hides_lines() {
            true => self.hidden.push(Line::Said(text.to_owned())),
            false => drop(self.terminal.say(text)),
        }
    }

    /// Prints and shows a warning.
    pub(super) fn warn(&mut self, text: &str) {
        self.bench.note(text);
        match self.hides_lines() {
            true => self.hidden.push(Line::Warned(text.to_owned())),
            false => self.terminal.warn(text),
        }
    }

    /// Shows the bench, if the last picture is old enough. A view that is gone is left out.
    pub(super) fn show(&mut self) {
        if self.shown.is_none_or(|shown| shown.elapsed() >= BETWEEN) {
            self.show_now();
        }
    }

    /// Shows the bench at once.
    fn show_now(&mut self) {
        self.shown = Some(Instant::now());
        let bench = &self.bench;
        self.live.retain_mut(|view| view.show(bench).is_ok());
        if !self.hides_lines() {
            self.print_hidden();
        }
    }

    /// Returns what was asked for since the last call.
    pub(super) fn actions(&mut self) -> Vec<Action> {
        let bench = &self.bench;
        let live = self.live.iter_mut();
        live.flat_map(|view| view.actions(bench)).collect()
    }

    /// Ends the view that hides lines, and prints them.
    pub(super) fn end_screen(&mut self) {
        self.live.retain(|view| !view.hides_lines());
        self.print_hidden();
    }

    fn print_hidden(&mut self) {
        for line in self.hidden.drain(..) {
            match line {
                Line::Said(text) => drop(self.terminal.say(&text)),
                Line::Warned(text) => self.terminal.warn(&text),
            }
        }
    }

    /// Says on all views what became of the recording.
    pub(super) fn finish(&mut self, words: &str) {
        self.bench.ended = Some(words.to_owned());
        if let Some((_, what)) = self.bench.title.split_once(' ') {
            self.bench.title = format!("ended: {what}");
        }
        self.show_now();
    }
}
