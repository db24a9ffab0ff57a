//! The live screen: the bench in the whole terminal, and keys.

use super::bench::{Action, Bench, Level};
use super::views::View;
use crate::listen::JudgedTap;
use crate::report::Screen;
use crate::taps::REACH;
use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, poll, read};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Block, Borders, List, ListItem, ListState, Paragraph, Sparkline};
use ratatui::{DefaultTerminal, Frame};
use std::io;
use std::time::Duration;

/// Channels whose movement is shown. More would leave no room for the taps.
const MOST_LEVELS: usize = 4;
/// Width of the names of channels (characters).
const NAME: u16 = 12;
/// Rows of a channel's movement, on a terminal that is tall.
const LEVEL_ROWS: u16 = 2;
/// Rows from which a terminal is tall.
const TALL: u16 = 30;
/// Rows below which a terminal shows no movement.
const SHORT: u16 = 16;
/// Rows of the advice, and of the newest doubt, at most.
const MOST_WORDS: usize = 3;
/// Rows to which a long sentence is cut before others are left out.
const LEAST_LINES: usize = 2;
/// Rows of the taps at least, with their heading.
const LEAST_TAP_ROWS: u16 = 4;
/// Width from which results stand beside the taps (characters); below they stand under them.
const WIDE: u16 = 110;

/// Time for which keys are waited for. Not 0: the library then looks for none.
const KEY_WAIT: Duration = Duration::from_millis(1);

/// The live screen. The terminal is as before once it is dropped.
pub(super) struct LiveScreen {
    terminal: DefaultTerminal,
    chosen: Chosen,
}

/// The tap that keys are for.
#[derive(Debug, Default)]
struct Chosen {
    /// Its time (s); `None` = the last one.
    time: Option<f64>,
    /// Time of the last tap when it was chosen (s). The next tap takes the choice back.
    last: f64,
}

impl LiveScreen {
    /// Takes the terminal.
    ///
    /// # Errors
    /// There is none that can be drawn on and that gives keys.
    pub(super) fn begin() -> io::Result<Self> {
        let terminal = ratatui::try_init()?;
        // A terminal without keys fails here.
        if let Err(cause) = poll(KEY_WAIT) {
            restore();
            return Err(cause);
        }
        Ok(Self {
            terminal,
            chosen: Chosen::default(),
        })
    }
}

impl Drop for LiveScreen {
    fn drop(&mut self) {
        restore();
    }
}

/// Gives the terminal back.
pub(super) fn restore() {
    ratatui::restore();
}

impl View for LiveScreen {
    fn show(&mut self, bench: &Bench) -> io::Result<()> {
        self.chosen.follow(bench);
        let chosen = &self.chosen;
        self.terminal.draw(|frame| draw(frame, bench, chosen))?;
        Ok(())
    }

    fn actions(&mut self, bench: &Bench) -> Vec<Action> {
        let mut actions = Vec::new();
        while poll(KEY_WAIT).unwrap_or(false) {
            if let Ok(Event::Key(key)) = read() {
                actions.extend(self.chosen.action_of(key, bench));
            }
        }
        actions
    }

    fn hides_lines(&self) -> bool {
        true
    }
}

impl Chosen {
    /// Returns the place of the tap among all.
    fn place(&self, bench: &Bench) -> Option<usize> {
        let last = bench.taps.len().checked_sub(1)?;
        let found = self.time.and_then(|time| {
            let mut taps = bench.taps.iter();
            taps.position(|tap| (tap.time - time).abs() <= REACH)
        });
        Some(found.unwrap_or(last))
    }

    /// Gives the choice back to the last tap once a later one has come.
    fn follow(&mut self, bench: &Bench) {
        let newest = bench.taps.last().map_or(0.0, |tap| tap.time);
        if newest > self.last + REACH {
            self.time = None;
        }
    }

    /// Returns the time of the tap (s).
    fn shown_time(&self, bench: &Bench) -> Option<f64> {
        self.place(bench).map(|place| bench.taps[place].time)
    }

    /// Chooses the tap `by` places further. Beyond the last one the newest is chosen, whichever that will be.
    fn move_by(&mut self, by: isize, bench: &Bench) {
        let Some(place) = self.place(bench) else {
            return;
        };
        let place = place.saturating_add_signed(by);
        let tap = bench
            .taps
            .get(place)
            .filter(|_| place + 1 < bench.taps.len());
        self.time = tap.map(|tap| tap.time);
        self.last = bench.taps.last().map_or(0.0, |tap| tap.time);
    }

    /// Returns what a key asks for.
    fn action_of(&mut self, key: KeyEvent, bench: &Bench) -> Option<Action> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        self.follow(bench);
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('c' | 'd') if is_control => Some(Action::Stop),
            _ if is_control => None,
            // The tap that is shown as chosen, whichever comes meanwhile.
            KeyCode::Char('a') => Some(Action::Accept(self.shown_time(bench))),
            KeyCode::Char('r') => Some(Action::Reject(self.shown_time(bench))),
            KeyCode::Char('u') => Some(Action::Undo),
            KeyCode::Char('n') => Some(Action::Next),
            // Other programs end with q.
            KeyCode::Char('s' | 'q') => Some(Action::Stop),
            KeyCode::Up => {
                self.move_by(-1, bench);
                None
            }
            KeyCode::Down => {
                self.move_by(1, bench);
                None
            }
            KeyCode::Esc => {
                self.time = None;
                None
            }
            _ => None,
        }
    }
}

/// Draws the bench. What a small terminal cannot hold is marked; advice, the newest doubt and keys stand from nine
/// rows on.
fn draw(frame: &mut Frame<'_>, bench: &Bench, chosen: &Chosen) {
    let area = frame.area();
    let screen = Screen::of(usize::from(area.width));
    let newest = bench.notes.back().map(|note| format!("! {note}"));
    let note = fitted(screen, newest.as_slice(), MOST_WORDS);
    let advice = fitted(screen, std::slice::from_ref(&bench.advice), MOST_WORDS);
    let page = bench.address.as_ref();
    let page = page.map(|address| format!("page: {address}"));
    let shown = bench.levels.len().min(MOST_LEVELS) as u16;
    let is_wide = area.width >= WIDE;
    let result_rows = match is_wide {
        true => result_rows(bench, Screen::of(usize::from(area.width / 2))),
        false => result_rows(bench, screen),
    };
    let middle_rows = match is_wide {
        true => result_rows.max(LEAST_TAP_ROWS),
        false => result_rows + LEAST_TAP_ROWS,
    };
    // Results need the room more than the movement.
    let needed = middle_rows + (note.len() + advice.len()) as u16 + 3;
    let level_rows = match area.height {
        0..SHORT => 0,
        height if height < needed + shown => 0,
        height if height < TALL.max(needed + LEVEL_ROWS * shown) => 1,
        _ => LEVEL_ROWS,
    };
    let [
        head,
        levels,
        middle,
        note_area,
        advice_area,
        page_area,
        keys,
    ] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(level_rows * shown),
        Constraint::Min(0),
        Constraint::Length(note.len() as u16),
        Constraint::Length(advice.len() as u16),
        Constraint::Length(u16::from(page.is_some())),
        Constraint::Length(1),
    ])
    .areas(area);
    draw_head(frame, head, bench);
    for (row, level) in bench.levels.iter().take(MOST_LEVELS).enumerate() {
        let area = Rect {
            y: levels.y + level_rows * row as u16,
            height: level_rows,
            ..levels
        };
        draw_level(frame, area.intersection(levels), level);
    }
    let [taps, results] = match is_wide {
        true => Layout::horizontal([Constraint::Percentage(50); 2]).areas(middle),
        // The taps get up to half, and what the results leave.
        false => {
            // Of many taps as many as there is room for. One more row: the symbol of the chosen one takes columns.
            let taps = bench.taps.iter().take(usize::from(middle.height));
            let lines = taps.map(|tap| tap_text(tap, screen).len() + 1);
            let left = middle.height.saturating_sub(result_rows);
            let rows = lines.sum::<usize>() as u16;
            let rows = rows.min(left.min(middle.height / 2));
            let taps = Constraint::Length(rows.max(LEAST_TAP_ROWS));
            Layout::vertical([taps, Constraint::Min(0)]).areas(middle)
        }
    };
    draw_taps(frame, taps, bench, chosen);
    draw_results(frame, results, bench);
    let colour = if bench.is_enough {
        Color::Green
    } else {
        Color::Yellow
    };
    let words = Style::new().fg(colour).add_modifier(Modifier::BOLD);
    frame.render_widget(Paragraph::new(text_of(note)).yellow(), note_area);
    frame.render_widget(Paragraph::new(text_of(advice)).style(words), advice_area);
    frame.render_widget(Line::from(page.unwrap_or_default()), page_area);
    frame.render_widget(key_line(bench), keys);
}

/// The lines of sentences, so many at most. Long sentences are cut first, and the last line says that something is missing.
fn fitted(screen: Screen, sentences: &[String], rows: usize) -> Vec<String> {
    let wrapped = sentences.iter().map(|text| screen.wrapped(text, 2));
    let mut all: Vec<Vec<String>> = wrapped
        .map(|text| text.lines().map(str::to_owned).collect())
        .collect();
    while all.iter().map(Vec::len).sum::<usize>() > rows
        && let Some(longest) = all.iter_mut().max_by_key(|lines| lines.len())
        && longest.len() > LEAST_LINES
    {
        longest.pop();
        if let Some(last) = longest.last_mut() {
            mark(last, screen.columns());
        }
    }
    let mut lines = all.concat();
    if lines.len() > rows {
        lines.truncate(rows);
        if let Some(last) = lines.last_mut() {
            mark(last, screen.columns());
        }
    }
    lines
}

/// Ends a line of at most so many columns with an ellipsis. It is cut between words: a number would become another one.
fn mark(line: &mut String, columns: usize) {
    let most = columns.saturating_sub(2);
    if line.ends_with('\u{2026}') {
        return;
    }
    if line.chars().count() > most {
        let indent = line.len() - line.trim_start().len();
        let kept: String = line.chars().take(most + 1).collect();
        // One long word alone is cut.
        *line = match kept.rfind(' ').filter(|space| *space > indent) {
            Some(space) => kept[..space].to_owned(),
            None => kept.chars().take(most).collect(),
        };
    }
    line.push_str(" \u{2026}");
}

fn text_of(lines: Vec<String>) -> Text<'static> {
    Text::from(lines.into_iter().map(Line::from).collect::<Vec<_>>())
}

fn draw_head(frame: &mut Frame<'_>, area: Rect, bench: &Bench) {
    let seconds = format!("{:.1} s", bench.seconds);
    let [title, time] = Layout::horizontal([
        Constraint::Min(10),
        Constraint::Length(seconds.chars().count() as u16 + 1),
    ])
    .areas(area);
    frame.render_widget(Line::from(bench.title.as_str()).bold(), title);
    frame.render_widget(Line::from(seconds).right_aligned(), time);
}

fn draw_level(frame: &mut Frame<'_>, area: Rect, level: &Level) {
    let [name, strip] =
        Layout::horizontal([Constraint::Length(NAME), Constraint::Min(10)]).areas(area);
    frame.render_widget(Line::from(level.name.as_str()).dim(), name);
    let mut heights = level.heights();
    let hidden = heights.len().saturating_sub(usize::from(strip.width));
    heights.drain(..hidden);
    let strip_widget = Sparkline::default().data(heights).max(1000).cyan();
    frame.render_widget(strip_widget, strip);
}

fn draw_taps(frame: &mut Frame<'_>, area: Rect, bench: &Bench, chosen: &Chosen) {
    let block = Block::new().borders(Borders::TOP).title(" taps ");
    let columns = usize::from(block.inner(area).width).saturating_sub(2);
    // Of many taps those about the chosen one: laying out all of them takes long.
    let place = chosen.place(bench).unwrap_or_default();
    let first = place.saturating_sub(usize::from(area.height));
    let shown = bench
        .taps
        .iter()
        .skip(first)
        .take(2 * usize::from(area.height));
    let items = shown.map(|tap| {
        let colour = match (&tap.rejection, &tap.overruled) {
            (Some(_), _) => Color::Red,
            (None, Some(_)) => Color::Yellow,
            (None, None) => Color::Green,
        };
        ListItem::new(text_of(tap_text(tap, Screen::of(columns))).fg(colour))
    });
    let list = List::new(items).block(block).highlight_symbol("> ");
    let mut state =
        ListState::default().with_selected(chosen.place(bench).map(|place| place - first));
    frame.render_stateful_widget(list, area, &mut state);
}

/// A tap in lines.
fn tap_text(tap: &JudgedTap, screen: Screen) -> Vec<String> {
    let words = screen.wrapped(&format!("{:.2} s {tap}", tap.time), 2);
    words.lines().map(str::to_owned).collect()
}

/// The results, and how certain they are.
fn result_sentences(bench: &Bench) -> Vec<String> {
    let mut sentences = bench.result.clone();
    if sentences.is_empty() {
        sentences.push("none yet".to_owned());
    }
    if !bench.precision.is_empty() {
        sentences.push(bench.precision.clone());
    }
    sentences
}

/// Rows of all of it, with its heading.
fn result_rows(bench: &Bench, screen: Screen) -> u16 {
    let sentences = result_sentences(bench).into_iter();
    let lines = sentences.map(|text| screen.wrapped(&text, 2).lines().count());
    1 + lines.sum::<usize>() as u16
}

fn draw_results(frame: &mut Frame<'_>, area: Rect, bench: &Bench) {
    let title = if bench.is_result_old {
        " earlier results "
    } else {
        " results "
    };
    let block = Block::new().borders(Borders::TOP).title(title);
    let inner = block.inner(area);
    let (screen, rows) = (
        Screen::of(usize::from(inner.width)),
        usize::from(inner.height),
    );
    let results = fitted(screen, &result_sentences(bench), rows);
    // The newest doubt stands above the advice.
    let earlier = bench.notes.iter().rev().skip(1);
    let earlier: Vec<String> = earlier.map(|note| format!("! {note}")).collect();
    let doubts = match rows.saturating_sub(results.len()) {
        0 => Vec::new(),
        rest => fitted(screen, &earlier, rest),
    };
    let mut text = text_of(results);
    text.extend(doubts.into_iter().map(|line| Line::from(line).yellow()));
    frame.render_widget(Paragraph::new(text).block(block), area);
}

fn key_line(bench: &Bench) -> Line<'static> {
    let mut keys = vec![
        ("a", "accept".to_owned()),
        ("r", "reject".to_owned()),
        ("u", "undo".to_owned()),
        ("s", "stop".to_owned()),
    ];
    if let Some(next) = &bench.next {
        // The advice names its place.
        let name = next.split(", ").next().unwrap_or(next);
        keys.push(("n", format!("next: {name}")));
    }
    keys.push(("up/down", "choose".to_owned()));
    let spans = keys.into_iter().flat_map(|(key, what)| {
        [
            Span::from(format!(" {key} ")).reversed(),
            Span::from(format!(" {what}  ")),
        ]
    });
    Line::from(spans.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::listen::News;
    use crate::taps::{Pulse, Rejection};
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn tap(time: f64, rejection: Option<Rejection>) -> JudgedTap {
        JudgedTap {
            time,
            peak: 18.24,
            unit: Some("N".to_owned()),
            pulse: Some(Pulse {
                width: 1.21e-3,
                fall_10_db: None,
                fall_20_db: None,
                usable_to: 832.0,
            }),
            excites_all: false,
            seconds: 4.96,
            has_ended: true,
            remaining: Some(0.0042),
            remedy: rejection.as_ref().map(|_| "Hit shorter."),
            rejection,
            overruled: None,
        }
    }

    fn bench() -> Bench {
        let double = Rejection::DoubleHit {
            delay: 0.0312,
            ratio: 0.341,
            limit: 0.1,
        };
        let mut bench = Bench {
            title: "recording low.wav, tap at 0.385 m".to_owned(),
            advice: "1 tap counts; 4 more are wanted".to_owned(),
            result: vec![
                "so far good".to_owned(),
                "modes 118.20 \u{b1} 0.04 Hz".to_owned(),
            ],
            next: Some("high.wav, tap at 0.385 m".to_owned()),
            address: Some("http://127.0.0.1:8000/0f/".to_owned()),
            ..Bench::default()
        };
        for step in 0..20 {
            let swing = if step % 10 == 5 { 8.0 } else { 1.0 };
            bench.hear(
                f64::from(step) / 20.0,
                &[("hammer", swing), ("tip", swing / 2.0)],
            );
        }
        bench.take(&News::Tap(tap(4.905, None)));
        bench.take(&News::Tap(tap(9.871, Some(double))));
        bench.note("channel 2: from 8.1 s on every sample is 0.");
        bench
    }

    fn drawn(columns: u16, rows: u16, bench: &Bench) -> String {
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).unwrap();
        terminal
            .draw(|frame| draw(frame, bench, &Chosen::default()))
            .unwrap();
        let buffer = terminal.backend().buffer();
        let lines = buffer.content().chunks(usize::from(columns)).map(|row| {
            let row: String = row.iter().map(|cell| cell.symbol()).collect();
            row.trim_end().to_owned() + "\n"
        });
        lines.collect()
    }

    #[test]
    fn limit_a_line_that_is_cut_ends_between_words() {
        for (text, wanted) in [
            ("recordings/cantilever.wav", "recordin \u{2026}"),
            ("  recordings/cantilever.wav", "  record \u{2026}"),
        ] {
            let mut line = text.to_owned();
            mark(&mut line, 10);
            assert_eq!(line, wanted);
        }
        let text = "620.4509 \u{b1} 0.0002; 975";
        for columns in 12..40 {
            let mut line = text.to_owned();
            mark(&mut line, columns);
            assert!(line.chars().count() <= columns, "{line}");
            let kept = line.strip_suffix(" \u{2026}").unwrap();
            assert!(
                format!("{text} ").starts_with(&format!("{kept} ")),
                "{line}"
            );
        }
    }

    #[test]
    fn regress_the_screen_has_all_that_is_needed() {
        let wanted = "\
recording low.wav, tap at 0.385 m                                          0.9 s
hammer      ▁▁▁▁█▁▁▁▁▁▁▁▁▁█▁▁▁▁
tip         ▁▁▁▁█▁▁▁▁▁▁▁▁▁█▁▁▁▁
 taps ──────────────────────────────────────────────────────────────────────────
  4.91 s accepted: peak 18.2 N, pulse 1.21 ms, excites up to 832 Hz, decays to
    0.42 % in 5.0 s
> 9.87 s REJECTED: double hit: a second excursion of 34 % after 31.2 ms (limit
    10 %). Hit shorter.

 results ───────────────────────────────────────────────────────────────────────
so far good
modes 118.20 ± 0.04 Hz








! channel 2: from 8.1 s on every sample is 0.
1 tap counts; 4 more are wanted
page: http://127.0.0.1:8000/0f/
 a  accept   r  reject   u  undo   s  stop   n  next: high.wav   up/down  choose
";
        assert_eq!(drawn(80, 24, &bench()), wanted);
    }

    #[test]
    fn limit_a_full_screen_keeps_every_sentence_and_marks_what_it_cuts() {
        let mut bench = bench();
        for place in 2..9 {
            bench.take(&News::Tap(tap(5.0 * f64::from(place), None)));
        }
        let long = |name: &str| format!("{name} {}", "118.20 \u{b1} 0.04; ".repeat(12));
        bench.result = ["modes", "Kt", "cause", "remedy"].map(long).to_vec();
        bench.advice = long("advice");
        let drawn = drawn(80, 20, &bench);
        for begin in [
            "> 40.00 s",
            "modes",
            "Kt",
            "cause",
            "remedy",
            "! channel",
            "advice",
            "page",
            " a ",
        ] {
            let mut lines = drawn.lines();
            assert!(
                lines.any(|line| line.starts_with(begin)),
                "{begin} in:\n{drawn}"
            );
        }
        let cut = drawn.lines().filter(|line| line.ends_with('\u{2026}'));
        assert!(cut.count() >= 4, "{drawn}");
    }

    #[test]
    fn limit_a_small_terminal_loses_parts_and_not_the_program() {
        for (columns, rows) in [(1, 1), (10, 3), (20, 8), (300, 100)] {
            drawn(columns, rows, &bench());
        }
        drawn(80, 24, &Bench::default());
        let short = drawn(80, 8, &bench());
        for begin in ["! channel", "1 tap counts", " a  accept"] {
            let mut lines = short.lines();
            assert!(
                lines.any(|line| line.starts_with(begin)),
                "{begin} in:\n{short}"
            );
        }
    }

    #[test]
    fn prop_keys_ask_for_what_the_last_line_says() {
        let bench = bench();
        let mut chosen = Chosen::default();
        let mut press = |code| chosen.action_of(KeyEvent::new(code, KeyModifiers::NONE), &bench);
        assert_eq!(press(KeyCode::Char('a')), Some(Action::Accept(Some(9.871))));
        assert_eq!(press(KeyCode::Char('r')), Some(Action::Reject(Some(9.871))));
        assert_eq!(press(KeyCode::Char('u')), Some(Action::Undo));
        assert_eq!(press(KeyCode::Char('n')), Some(Action::Next));
        assert_eq!(press(KeyCode::Char('s')), Some(Action::Stop));
        assert_eq!(press(KeyCode::Char('x')), None);
        // One up is the first tap; beyond it is none.
        for _ in 0..3 {
            assert_eq!(press(KeyCode::Up), None);
        }
        assert_eq!(press(KeyCode::Char('r')), Some(Action::Reject(Some(4.905))));
        // Down to the last one, which the next tap takes over.
        assert_eq!(press(KeyCode::Down), None);
        assert_eq!(press(KeyCode::Char('r')), Some(Action::Reject(Some(9.871))));
        assert_eq!(press(KeyCode::Up), None);
        assert_eq!(press(KeyCode::Esc), None);
        assert_eq!(press(KeyCode::Char('a')), Some(Action::Accept(Some(9.871))));
        assert_eq!(press(KeyCode::Char('q')), Some(Action::Stop));
        // The next tap takes the choice back.
        assert_eq!(press(KeyCode::Up), None);
        let mut more = bench.clone();
        more.take(&News::Tap(tap(14.8, None)));
        let key = KeyEvent::new(KeyCode::Char('r'), KeyModifiers::NONE);
        assert_eq!(
            chosen.action_of(key, &more),
            Some(Action::Reject(Some(14.8)))
        );
        let stop = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(chosen.action_of(stop, &bench), Some(Action::Stop));
    }
}
