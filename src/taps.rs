//! Finding taps in a recording.
