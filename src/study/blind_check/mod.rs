//! The blind check: virtual tests whose effect is withheld, diagnosed and scored.
//!
//! ```text
//! draw -> recordings and description (without the truth) -> diagnosis -> answers
//!   \-> truth, sealed by a commitment -----------------------------------> score
//! ```
//!
//! The diagnosis sees recordings and description alone; it shares no random state with what drew
//! the tests. The definitions of the effects are shared, so that the score is an upper bound:
//! tests made elsewhere ([`parse_truths`]) are the check that counts.

mod answer;
mod calibration;
mod case;
mod commitment;
mod draw;
mod ideal;
mod limits;
mod mutation;
mod outside;
mod rate;
mod record;
mod score;
mod sizes;
mod table;
mod truth_file;

pub use calibration::{Calibration, ReliabilityBin};
pub use case::{Answer, CaseKind, Class, Planted, Truth, Verdict};
pub use commitment::commitment;
pub use draw::{Campaign, DrawError, DrawnTest, Extent};
pub use mutation::{Conduct, always_scale, shuffled};
pub use outside::{Fastened, OutsideKind};
pub use rate::Rate;
pub use record::{Recorded, RecordedTest};
pub use score::{Case, SET_SHARE, Scores, score};
pub use sizes::{GROUPS, draw_effect};
pub use table::{Row, Target, render_rows, rows};
pub use truth_file::{TruthDoubt, TruthError, TruthFile, parse_truths};
