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

pub use case::{Answer, Case, CaseKind, Class, EstimatedParameter, Extent, Planted, Truth};
pub(crate) use draw::record_channels;
pub use draw::{Campaign, DrawError, DrawnTest, Recorded, RecordedTest};
pub use planted_effects::{Fastened, GROUPS, OutOfCatalogueKind, draw_effect, log_uniform, normal};
pub use score::{
    Calibration, Conduct, Rate, ReliabilityBin, Scores, always_scale, score, shuffled,
};
pub use table::{Row, Target, render_rows, rows};
pub use truth_file::{TruthError, TruthFile, commitment, parse_truths};
