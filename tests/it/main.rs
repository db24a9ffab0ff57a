//! Integration tests: one module per stage of the pipeline.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod amplitude;
mod blind_check;
mod blind_check_draw;
mod cli;
mod cli_frf;
mod combinations;
mod corpus;
mod deck;
mod deck_with_effects;
mod description;
mod effects;
mod errors;
mod fastened;
mod function_modes;
mod gap;
mod gap_advice;
mod gap_decay;
mod gap_fixture;
#[path = "../golden/mod.rs"]
mod golden;
mod identify;
mod identify_consistent;
mod identify_perturbation;
mod interval_coverage;
mod joint_law;
mod laboratory;
mod mains;
mod modal_fit;
mod mode_file;
mod moved_clamp;
mod observations;
mod pairing;
mod pipeline;
mod pipeline_fits;
mod plan;
mod predicted_shapes;
mod real_data;
mod recording_uff;
mod report;
mod resolution;
mod scales;
mod set_ups;
mod several_files;
mod shared;
mod simulate;
mod simulate_cli;
mod simulate_motion;
mod simulate_seen;
mod simulate_test;
mod specimen;
mod strengths;
mod structure;
mod taps_double_hit;
mod updated_model;
