//! SVG files: that they need no font, and hold every letter.

use std::path::Path;
use tapjoint::report::picture::{PictureFormat, render_picture, render_svg_file};

use super::pictures::drawings;

/// What stands between `before` and the next quotation mark, everywhere.
fn quoted<'a>(svg: &'a str, before: &str) -> Vec<&'a str> {
    svg.split(before)
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .collect()
}

#[test]
fn regress_svg_files_ask_for_no_font() {
    for drawing in drawings() {
        let svg = render_svg_file(&drawing).expect("the picture is drawn");
        let name = &drawing.description;
        for word in ["<text", "font", "<image", "<style"] {
            assert!(!svg.contains(word), "{name}: {word}");
        }
        assert!(svg.contains("xmlns=\"http://www.w3.org/2000/svg\""));
        assert!(svg.contains(&format!("<title>{name}</title>")), "{name}");
    }
}

#[test]
fn prop_every_letter_of_a_picture_has_its_outline() {
    for drawing in drawings() {
        let svg = render_svg_file(&drawing).expect("the picture is drawn");
        let defined = quoted(&svg, "<path id=\"");
        let used = quoted(&svg, "xlink:href=\"#");
        let words = drawing.words();
        let letters = words.iter().flat_map(|text| text.chars());
        let letters = letters.filter(|letter| !letter.is_whitespace()).count();
        assert_eq!(used.len(), letters, "{}", drawing.description);
        assert!(used.iter().all(|name| defined.contains(name)));
        let mut once = defined.clone();
        once.dedup();
        assert_eq!(once, defined, "an outline is defined once");
    }
}

#[test]
fn prop_svg_files_are_no_larger_than_a_paper_takes() {
    for drawing in drawings() {
        let svg = render_svg_file(&drawing).expect("the picture is drawn");
        assert!(
            svg.len() < 400_000,
            "{}: {} bytes",
            drawing.description,
            svg.len()
        );
    }
}

#[test]
fn regress_the_name_of_a_file_decides_its_kind() {
    let of = |name: &str| PictureFormat::of(Path::new(name));
    assert_eq!(of("a/frf.svg"), PictureFormat::Svg);
    assert_eq!(of("frf.SVG"), PictureFormat::Svg);
    assert_eq!(of("frf.png"), PictureFormat::Png);
    assert_eq!(of("frf"), PictureFormat::Png);
    let drawing = &drawings()[0];
    let bytes = |format| render_picture(drawing, format).expect("the picture is drawn");
    assert!(bytes(PictureFormat::Png).starts_with(b"\x89PNG"));
    assert!(bytes(PictureFormat::Svg).starts_with(b"<svg "));
}
