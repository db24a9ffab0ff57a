//! Published numbers: one module per source.

mod ingole_chatterjee;
