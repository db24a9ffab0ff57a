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

mod case;
mod draw;
mod planted_effects;
mod score;
mod table;
mod truth_file;

pub use case::{Answer, CaseKind, Class, Planted, Truth};
pub use draw::{Campaign, DrawError, DrawnTest, Extent};
pub use draw::{Recorded, RecordedTest};
pub use planted_effects::{Fastened, OutsideKind};
pub use planted_effects::{GROUPS, draw_effect};
pub use score::Rate;
pub use score::{Calibration, ReliabilityBin};
pub use score::{Case, SET_SHARE, Scores, score};
pub use score::{Conduct, always_scale, shuffled};
pub use table::{Row, Target, render_rows, rows};
pub use truth_file::commitment;
pub use truth_file::{TruthDoubt, TruthError, TruthFile, parse_truths};
