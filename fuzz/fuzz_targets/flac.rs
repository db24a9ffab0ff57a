#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| tapjoint_fuzz::run("flac", bytes));
