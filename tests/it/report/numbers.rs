//! Numbers as they are written.

use proptest::prelude::*;
use tapjoint::report::format::{
    bound_percent, frequency_reading, line_reading, optional, prefix, rounded, rounded_digits,
    signed, signed_percent, significant, trimmed, unit_words, with_decimals_of,
};

#[test]
fn val_digits_nobody_can_use_are_left_out() {
    let cases = [
        // Rounded up, so that the bound still holds.
        (7.4867451, 0.0000036, Some(0.042), "7.4867 ± 0.0001"),
        (117.08604, 0.00011, Some(0.125), "117.0860 ± 0.0002"),
        (994.0132, 0.0025, Some(0.5), "994.0132 ± 0.0025"),
        (80.466, 0.035, None, "80.466 ± 0.035"),
        // Lines 0.0008 Hz apart need their digits.
        (7.4867451, 0.0000036, Some(0.0004), "7.4867451 ± 0.0000036"),
    ];
    for (frequency, bound, half_line, wanted) in cases {
        let written = frequency_reading(frequency, bound, half_line).joined();
        assert_eq!(
            written, wanted,
            "{frequency} ± {bound}, half line {half_line:?}"
        );
    }
    assert_eq!(
        rounded_digits(0.508082, Some(0.000023), 4).joined(),
        "0.5081 ± 0.0001"
    );
    assert_eq!(
        rounded_digits(1.994203, Some(0.25), 5).joined(),
        "1.99 ± 0.25"
    );
    assert_eq!(bound_percent(0.000048), "±0.001");
    assert_eq!(bound_percent(0.0003), "±0.001");
    assert_eq!(bound_percent(0.735), "±0.73");
    assert_eq!(bound_percent(f64::NAN), "–");
    assert_eq!(with_decimals_of(331.0618, "335.625"), "331.062");
    assert_eq!(unit_words("(m/s2)/N"), "(m/s²)/N");
}

#[test]
fn val_digits_follow_the_uncertainty() {
    let cases = [
        (17.003, Some(0.0041), "17.0030 ± 0.0041"),
        (1414.0, Some(9.0), "1414.0 ± 9.0"),
        (1414.2, Some(0.0996), "1414.20 ± 0.10"),
        (1414.2, Some(120.4), "1410 ± 120"),
        (-2.7641, Some(0.02), "−2.764 ± 0.020"),
        (141_421.0, Some(995.0), "141400 ± 1000"),
        (1.0e9, Some(2.3e6), "1.0000e9 ± 0.0023e9"),
        (3.0e-9, Some(2.0e-10), "3.00e-9 ± 0.20e-9"),
        (0.0, Some(0.5), "0.00 ± 0.50"),
        (-0.001, Some(0.5), "0.00 ± 0.50"),
        (123.456, None, "123.5"),
        (123.456, Some(0.0), "123.5"),
        (123.456, Some(f64::NAN), "123.5"),
        (f64::NAN, Some(1.0), "–"),
        (f64::INFINITY, Some(1.0), "∞"),
    ];
    for (value, uncertainty, wanted) in cases {
        let written = rounded(value, uncertainty).joined();
        assert_eq!(written, wanted, "{value} ± {uncertainty:?}");
    }
}

#[test]
fn val_lines_keep_their_exact_fractions() {
    let cases = [
        (335.625, 0.625, "335.625 ± 0.625"),
        (17.0, 0.125, "17.000 ± 0.125"),
        (118.0, 0.5, "118.0 ± 0.5"),
        (995.0, 1.25, "995.00 ± 1.25"),
        (17.0, 0.0416667, "17.000 ± 0.042"),
        (85.28, 0.02, "85.28 ± 0.02"),
    ];
    for (line, half_line, wanted) in cases {
        assert_eq!(
            line_reading(line, half_line).joined(),
            wanted,
            "line {line}, half line {half_line}"
        );
    }
}

#[test]
fn val_other_numbers() {
    assert_eq!(significant(0.0, 4), "0");
    assert_eq!(significant(9.9996, 4), "10.00");
    assert_eq!(significant(9.7e9, 4), "9.700e9");
    assert_eq!(significant(9.999_99e9, 4), "1.000e10");
    assert_eq!(significant(1.5e12, 3), "1.50e12");
    assert_eq!(significant(f64::NEG_INFINITY, 3), "−∞");
    assert_eq!(optional(None, 3), "–");
    assert_eq!(trimmed(5120.0, 8), "5120");
    assert_eq!(trimmed(0.25, 4), "0.25");
    assert_eq!(signed(0.05), "+0.05");
    assert_eq!(signed(-0.1), "−0.1");
    assert_eq!(signed_percent(Some(0.3149)), "+0.31");
    assert_eq!(signed_percent(Some(-12.4)), "−12");
    assert_eq!(signed_percent(Some(-0.0)), "0");
    assert_eq!(signed_percent(Some(-1e-9)), "0.000");
    assert_eq!(signed_percent(None), "–");
    assert_eq!(prefix(1.382e6), (1e-6, "M"));
    assert_eq!(prefix(318.9), (1.0, ""));
}

/// The number that a text stands for.
fn parsed(text: &str) -> f64 {
    text.replace('−', "-").parse().expect("it is a number")
}

proptest! {
    #[test]
    fn prop_rounding_stays_within_half_of_the_last_digit(
        value in -1e9f64..1e9,
        exponent in -6.0f64..6.0,
    ) {
        let uncertainty = 10f64.powf(exponent);
        let written = rounded(value, Some(uncertainty));
        let shown = parsed(written.uncertainty.as_deref().unwrap_or("nothing"));
        // Two digits: at most half a unit in the second, 5 % of the uncertainty.
        prop_assert!(
            (shown - uncertainty).abs() <= 0.0501 * uncertainty,
            "{uncertainty} was written {shown}"
        );
        // The value ends at the same digit, so it is off by 5 % of the uncertainty at most; the
        // last term is what f64 leaves of a value of that size.
        let off = (parsed(&written.value) - value).abs();
        prop_assert!(
            off <= 0.0501 * uncertainty + 1e-15 * value.abs(),
            "{value} ± {uncertainty} was written {}", written.joined()
        );
    }

    #[test]
    fn prop_value_and_uncertainty_end_at_the_same_digit(
        value in -1e6f64..1e6,
        exponent in -5.0f64..5.0,
    ) {
        let written = rounded(value, Some(10f64.powf(exponent)));
        let decimals = |text: &str| text.split_once('.').map_or(0, |(_, digits)| digits.len());
        let uncertainty = written.uncertainty.clone().unwrap_or_default();
        prop_assert_eq!(
            decimals(&written.value),
            decimals(&uncertainty),
            "{}", written.joined()
        );
    }

    #[test]
    fn prop_capped_bounds_still_hold(
        value in 1.0f64..1e4,
        exponent in -9.0f64..1.0,
    ) {
        let bound = 10f64.powf(exponent);
        let written = frequency_reading(value, bound, None);
        let shown = parsed(written.uncertainty.as_deref().unwrap_or("nothing"));
        // Two digits may round down by 5 %; a capped bound is rounded up.
        prop_assert!(shown >= 0.9499 * bound, "{bound} was written {shown}");
        prop_assert!(shown >= 1e-4 * (1.0 - 1e-9), "finer than four decimals: {shown}");
    }

    #[test]
    fn prop_significant_digits_hold_the_value(value in prop::num::f64::NORMAL) {
        let shown = parsed(&significant(value, 4));
        // Four digits: half a unit in the fourth.
        prop_assert!(
            (shown - value).abs() <= 0.000501 * value.abs(),
            "{value} was written {shown}"
        );
    }
}
