//! Mode shapes as they were measured, beside those of the model.
//!
//! A set-up sees a shape at the places of its sensors, relative to the sensor with the largest motion. Recordings with
//! taps at several places see it at these places, by their modal constants. Their masses and sensors must be the same.
//! Sensor and tap can change places without another answer (reciprocity).

use super::Analysis;
use super::identification::SampledShape;
use super::observations::observations;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_identify::observation::{Configuration, Observed, ObservedMode, ObservedSensor};
use tapjoint_numerics::stats::student;

/// Places that a comparison of shapes needs: two places agree with many shapes.
const LEAST_PLACES: usize = 3;

/// What stood at the places of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShapeBy {
    /// Sensors of one recording.
    Sensors,
    /// Taps of several recordings.
    Taps,
}

/// The shape of one mode as one set-up measured it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeasuredShape {
    /// The model's number.
    pub mode: usize,
    /// Files of the recordings.
    pub recordings: Vec<String>,
    /// What stood at the places.
    pub by: ShapeBy,
    /// The places.
    pub points: Vec<ShapePoint>,
}

/// A measured shape at one place. One factor scales the points of a shape, so that they fit the predicted one best
/// (modal scale factor: Allemang, "The modal assurance criterion: twenty years of use and abuse", 2003).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ShapePoint {
    /// Name of the sensor.
    pub sensor: String,
    /// Position from the joint; of a lap joint or a free beam from the left end (m).
    pub position: f64,
    /// Displacement relative to the largest of the predicted shape (1).
    pub displacement: f64,
    /// Lower 95 % limit (1), by noise and the scatter of the taps; null at the sensor that the others are relative to.
    /// An error of a sensor's scale or place is no part of it.
    pub low: Option<f64>,
    /// Upper 95 % limit (1).
    pub high: Option<f64>,
}

/// Modal assurance criterion of measured and predicted shapes, at the places of the set-up with most of them.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ShapeAgreement {
    /// Files of the recordings.
    pub recordings: Vec<String>,
    /// What stood at the places.
    pub by: ShapeBy,
    /// Number of places.
    pub places: usize,
    /// Measured modes: the rows.
    pub measured: Vec<usize>,
    /// Predicted modes: the columns.
    pub predicted: Vec<usize>,
    /// (u v)^2 / ((u u)(v v)) of each measured shape u and predicted shape v (1).
    pub values: Vec<Vec<f64>>,
}

/// Returns the measured shapes of all set-ups with two places or more, in the order of the modes. A set-up with other
/// fastened masses than the first one has other shapes, and is left out.
pub fn measured_shapes(analysis: &Analysis, predicted: &[SampledShape]) -> Vec<MeasuredShape> {
    let mut configurations = observations(analysis).configurations;
    // Shapes do not depend on the level of the taps: one level of a recording is enough.
    configurations.dedup_by_key(|one| one.recording);
    let masses = configurations.first().map(|one| one.masses.clone());
    configurations.retain(|one| Some(&one.masses) == masses.as_ref());
    let mut shapes = Vec::new();
    for shape in predicted {
        let seen = configurations.iter();
        let seen = seen.filter_map(|one| Some((one, one.mode(shape.mode)?)));
        let seen: Vec<(&Configuration, &ObservedMode)> = seen.collect();
        for (configuration, mode) in &seen {
            shapes.push(at_sensors(shape.mode, configuration, mode));
        }
        shapes.extend(at_taps(shape.mode, &seen));
        for own in shapes.iter_mut().filter(|own| own.mode == shape.mode) {
            own.fit_to(shape);
        }
    }
    shapes.retain(|shape| shape.places() >= 2);
    shapes
}

/// Returns how well measured and predicted shapes agree; `None` where no set-up has three places.
pub fn shape_agreement(
    measured: &[MeasuredShape],
    predicted: &[SampledShape],
) -> Option<ShapeAgreement> {
    let most = measured.iter().map(MeasuredShape::places).max();
    let places = most.filter(|places| *places >= LEAST_PLACES)?;
    let best = measured.iter().find(|shape| shape.places() == places)?;
    let of_best = measured.iter().filter(|one| {
        one.by == best.by && one.recordings == best.recordings && one.places() == places
    });
    let mut agreement = ShapeAgreement {
        recordings: best.recordings.clone(),
        by: best.by,
        places,
        measured: Vec::new(),
        predicted: predicted.iter().map(|shape| shape.mode).collect(),
        values: Vec::new(),
    };
    for shape in of_best {
        agreement.measured.push(shape.mode);
        let row = predicted.iter().map(|other| shape.assurance(other));
        agreement.values.push(row.collect());
    }
    Some(agreement)
}

/// Returns the shape at the sensors of a recording whose places are known, relative to its strongest sensor.
fn at_sensors(number: usize, configuration: &Configuration, mode: &ObservedMode) -> MeasuredShape {
    let mut shape = MeasuredShape {
        mode: number,
        recordings: configuration.file.iter().cloned().collect(),
        by: ShapeBy::Sensors,
        points: Vec::new(),
    };
    for value in &mode.shape {
        let sensor = &configuration.sensors[value.sensor];
        let read = Observed {
            value: value.value,
            std: value.std,
            freedom: value.freedom,
        };
        shape.add(sensor, sensor.position, read);
    }
    shape
}

/// Returns the shapes at the taps of recordings with all sensors at the same places.
fn at_taps(number: usize, seen: &[(&Configuration, &ObservedMode)]) -> Vec<MeasuredShape> {
    let mut shapes: Vec<(&[ObservedSensor], usize, MeasuredShape)> = Vec::new();
    for (configuration, mode) in seen {
        let (Some(reference), Some(constant), Some(file)) =
            (mode.reference, mode.constant, &configuration.file)
        else {
            continue;
        };
        let sensors = configuration.sensors.as_slice();
        if sensors[reference].position.is_none() {
            continue;
        }
        let known = shapes
            .iter()
            .position(|(others, strongest, _)| *others == sensors && *strongest == reference);
        let place = known.unwrap_or_else(|| {
            let shape = MeasuredShape {
                mode: number,
                recordings: Vec::new(),
                by: ShapeBy::Taps,
                points: Vec::new(),
            };
            shapes.push((sensors, reference, shape));
            shapes.len() - 1
        });
        // The scatter of the taps has one degree of freedom less than there are taps.
        let scatter = (configuration.taps > 1).then_some(configuration.taps as f64 - 1.0);
        let constant = Observed {
            freedom: constant.freedom.or(scatter),
            ..constant
        };
        let (_, _, shape) = &mut shapes[place];
        shape.add(&sensors[reference], configuration.tap, constant);
        shape.recordings.push(file.clone());
    }
    shapes.into_iter().map(|(_, _, shape)| shape).collect()
}

impl MeasuredShape {
    /// Adds a point, if its place is known, with 95 % limits by Student's t.
    fn add(&mut self, sensor: &ObservedSensor, position: Option<f64>, read: Observed) {
        let Some(position) = position else { return };
        let factor = read
            .freedom
            .map_or(1.96, |freedom| student::quantile(0.05, freedom));
        let half = factor * read.std;
        let is_known = half > 0.0 && half.is_finite();
        self.points.push(ShapePoint {
            sensor: sensor.name.clone(),
            position,
            displacement: read.value,
            low: is_known.then_some(read.value - half),
            high: is_known.then_some(read.value + half),
        });
    }

    /// Number of different places.
    fn places(&self) -> usize {
        let mut places: Vec<f64> = self.points.iter().map(|point| point.position).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        places.len()
    }

    /// Scales its points by s = (u v)/(u u), u being its displacements and v the predicted ones.
    fn fit_to(&mut self, predicted: &SampledShape) {
        let [own, both, _] = self.products(predicted);
        let scale = both / own;
        if !scale.is_finite() {
            return;
        }
        for point in &mut self.points {
            point.displacement *= scale;
            let ends = [point.low, point.high].map(|end| end.map(|end| end * scale));
            [point.low, point.high] = match scale < 0.0 {
                true => [ends[1], ends[0]],
                false => ends,
            };
        }
    }

    fn assurance(&self, predicted: &SampledShape) -> f64 {
        let [own, both, other] = self.products(predicted);
        both * both / (own * other)
    }

    /// u u, u v and v v of its displacements u and the predicted ones v at its places.
    fn products(&self, predicted: &SampledShape) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for point in &self.points {
            let there = predicted.at(point.position);
            sums[0] += point.displacement * point.displacement;
            sums[1] += point.displacement * there;
            sums[2] += there * there;
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shape x^2 of a beam of 1 m.
    fn parabola() -> SampledShape {
        let positions: Vec<f64> = (0..=100).map(|index| 0.01 * f64::from(index)).collect();
        SampledShape {
            mode: 1,
            frequency: 10.0,
            displacements: positions.iter().map(|x| x * x).collect(),
            positions,
        }
    }

    fn line() -> SampledShape {
        let mut shape = parabola();
        shape.mode = 2;
        shape.displacements.clone_from(&shape.positions);
        shape
    }

    fn measured(factor: f64) -> MeasuredShape {
        let mut shape = MeasuredShape {
            mode: 1,
            recordings: vec!["a.wav".to_owned()],
            by: ShapeBy::Sensors,
            points: Vec::new(),
        };
        for place in [0.2, 0.5, 1.0] {
            let sensor = ObservedSensor {
                name: "A".to_owned(),
                position: Some(place),
            };
            let read = Observed {
                value: factor * place * place,
                std: 0.01,
                freedom: None,
            };
            shape.add(&sensor, sensor.position, read);
        }
        shape
    }

    #[test]
    fn prop_a_shape_of_any_scale_and_sign_lies_on_the_prediction() {
        for factor in [-3.0, 1e-6, 40.0] {
            let mut shape = measured(factor);
            shape.fit_to(&parabola());
            for point in &shape.points {
                assert!((point.displacement - point.position.powi(2)).abs() < 1e-12);
                assert!(
                    point.low < Some(point.displacement) && Some(point.displacement) < point.high
                );
            }
        }
    }

    #[test]
    fn val_the_assurance_of_a_parabola_and_a_line() {
        // At 0.2, 0.5 and 1: u = (0.04, 0.25, 1), v = (0.2, 0.5, 1); (u v)^2/((u u)(v v)) = 1.133^2/(1.0641 1.29).
        let shapes = [parabola(), line()];
        let found = shape_agreement(&[measured(2.0)], &shapes).unwrap();
        assert_eq!(found.places, 3);
        assert!((found.values[0][0] - 1.0).abs() < 1e-12);
        assert!((found.values[0][1] - 1.133f64.powi(2) / (1.0641 * 1.29)).abs() < 1e-12);
    }

    #[test]
    fn limit_two_places_compare_no_shapes() {
        let mut shape = measured(1.0);
        shape.points.pop();
        assert_eq!(shape_agreement(&[shape], &[parabola()]), None);
    }
}
