//! The tables of Ingole & Chatterjee, digits as printed.
