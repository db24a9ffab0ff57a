//! From the listing of a universal file to the document.

use super::document::DatasetSection;
use tapjoint_signal::recording::{
    Abscissa, Dataset, Function, Ordinate, Precision, UffCoding, UniversalFile,
};

/// The datasets of universal files, in their order. `name` is the file as tables show it.
pub fn datasets(name: &str, file: &UniversalFile) -> Vec<DatasetSection> {
    let datasets = file.datasets.iter();
    datasets.map(|dataset| section(name, dataset)).collect()
}

fn section(name: &str, dataset: &Dataset) -> DatasetSection {
    let listed = DatasetSection {
        file: name.to_owned(),
        dataset: dataset.number,
        dataset_type: dataset.kind,
        kind: dataset.kind_name(),
        bytes: dataset.bytes,
        ..Default::default()
    };
    match &dataset.function {
        Some(function) => with_function(listed, function),
        None => listed,
    }
}

fn with_function(listed: DatasetSection, function: &Function) -> DatasetSection {
    let (start, spacing) = match function.abscissa {
        Abscissa::Even { start, step, .. } => (Some(start), Some(step)),
        Abscissa::Uneven => (None, None),
    };
    let coding = match function.coding {
        UffCoding::Ascii => "text",
        UffCoding::Binary { order: 2, .. } => "binary, big endian",
        UffCoding::Binary { .. } => "binary, little endian",
    };
    let values = match (function.ordinate, function.precision) {
        (Ordinate::Real, Precision::Single) => "real, single",
        (Ordinate::Real, Precision::Double) => "real, double",
        (Ordinate::Complex, Precision::Single) => "complex, single",
        (Ordinate::Complex, Precision::Double) => "complex, double",
    };
    let point = |text: String| (text != "-").then_some(text);
    DatasetSection {
        function_type: Some(function.function_type.0),
        points: Some(function.points),
        start,
        spacing,
        spacing_unit: function.abscissa_axis.unit.clone(),
        response: point(function.response.to_string()),
        reference: point(function.reference.to_string()),
        quantity: function.numerator.quantity_name().map(str::to_owned),
        unit: function.numerator.unit.clone(),
        denominator_unit: function.denominator.unit.clone(),
        coding: Some(coding.to_owned()),
        values: Some(values.to_owned()),
        description: function.id_lines[0].clone(),
        date: function.id_lines[2].clone(),
        ..listed
    }
}
