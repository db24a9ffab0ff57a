//! The check of comparisons: pairs of tests between which something changed, compared without the change and scored.
//!
//! ```text
//! draw -> structure before and after, described alike
//!   |       -> record -> recordings and descriptions (without the change) -> comparison -> answers
//!   \-> truth, sealed by a commitment --------------------------------------------------> score
//! ```
//!
//! The comparison sees recordings and descriptions alone. The definitions of the effects are shared, so that the score is an
//! upper bound: pairs made elsewhere ([`parse_pair_truths`]) are the check that counts.

mod draw;
mod record;
mod score;
mod truth;

pub use draw::{ChangeClass, ChangedStructure, VISIBLE, chi_square, draw_repeatability, structure};
pub use record::{DrawnPair, PairCampaign};
pub use score::{
    AnsweredPair, PairAnswer, PairCase, PairConduct, PairScores, pair_rows, score_pairs,
};
pub use truth::{
    PairKind, PairTruth, PairTruthFile, PlantedChange, pair_truths_json, parse_pair_truths,
};
