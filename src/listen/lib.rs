//! Judging taps while they are recorded.
//!
//! A recorder writes a WAV file, and a [`Listener`] reads it behind the recorder. It takes the samples in steps of equal
//! length. A sudden rise in a step is an alarm. When the record of a tap has ended, the listener looks: it finds the taps of
//! the whole recording so far as `run` does, and reports what is new. So its decisions after the last sample are
//! those of `run` on the file. A decision that later samples change is reported again.
//!
//! The steps count samples and no time of day: the same file gives the same news, however fast it grows.

mod alarm;
mod listener;
mod news;
mod precision;
mod silence;

pub use listener::{ListenError, ListenSettings, Listener, Settled};
pub use news::{JudgedTap, News};
pub use precision::Precision;
