//! Curves of one prim, with all that its attributes say, and their strands.

use glam::{DAffine3, Vec3, Vec4};
use openusd::sdf::Value;

use super::File;
use super::curves::{Basis, Interpolation, Shape, Wrap};
use super::layer::Layer;
use super::nurbs::Nurbs;
use super::stage::{Kind, Shown};
use super::transform;
use crate::model::strands::is_place;
use crate::util::error::Result;

/// Curves of a prim.
pub(super) struct Curves {
    path: String,
    shape: Shape,
    counts: Vec<usize>,
    /// Points in the stage's space.
    pub points: Vec<Vec3>,
    /// Diameters in the stage's space; empty where the prim has none.
    widths: Vec<f32>,
    interpolation: Interpolation,
    nurbs: Option<Knots>,
}

/// What NURBS curves have beside their points.
struct Knots {
    orders: Vec<usize>,
    knots: Vec<f64>,
    weights: Option<Vec<f64>>,
}

/// What is told about curves.
#[derive(Default)]
pub(super) struct Told {
    /// Curves of too few points for a segment.
    pub too_short: usize,
    /// Curves without widths.
    pub without_width: usize,
    /// Curves with points behind their last segment.
    pub uneven: usize,
}

impl Curves {
    /// Reads a prim. `None` for one without points.
    ///
    /// # Errors
    /// [`Error::Input`](crate::util::error::Error::Input) for numbers that do not fit together or are not
    /// finite; [`Error::Memory`](crate::util::error::Error::Memory) for too many.
    pub fn read(
        layer: &mut Layer,
        shown: &Shown,
        time: Option<f64>,
        file: &mut File,
    ) -> Result<Option<Curves>> {
        let path = &shown.path;
        let points = match layer.attribute(path, "points", time, file)?.as_deref() {
            Some(Value::Vec3fVec(points)) => points.iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect(),
            None | Some(Value::ValueBlock) => Vec::new(),
            Some(_) => return Err(file.broken(format!("{path}.points: they are not of the type point3f[]"))),
        };
        let counts = whole_numbers(layer, path, "curveVertexCounts", time, file)?.unwrap_or_default();
        if points.is_empty() && counts.is_empty() {
            return Ok(None);
        }
        let sum = counts.iter().fold(0usize, |sum, count| sum.saturating_add(*count));
        if sum != points.len() {
            let have = points.len();
            return Err(
                file.broken(format!("{path}: curveVertexCounts add up to {sum}, there are {have} points"))
            );
        }
        let points = placed(path, points, &shown.stage_from_own, file)?;
        let shape = match shown.kind {
            Kind::Nurbs => Shape { basis: Basis::Linear, wrap: Wrap::Nonperiodic },
            Kind::Basis => shape(layer, path, time, file)?,
        };
        let nurbs = match shown.kind {
            Kind::Basis => None,
            Kind::Nurbs => Some(Knots {
                orders: whole_numbers(layer, path, "order", time, file)?.unwrap_or_default(),
                knots: numbers(layer, path, "knots", time, file)?.unwrap_or_default(),
                weights: numbers(layer, path, "pointWeights", time, file)?.filter(|own| !own.is_empty()),
            }),
        };
        let (widths, interpolation) = widths(layer, path, shape, &counts, time, file)?;
        let scale = shown.stage_from_own.matrix3.determinant().abs().cbrt();
        let widths: Vec<f32> = widths.iter().map(|width| (width * scale) as f32).collect();
        if let Some(at) = widths.iter().position(|width| !(width.is_finite() && *width >= 0.0)) {
            return Err(file.broken(format!("{path}.widths: width {at} is {}", widths[at])));
        }
        let path = path.clone();
        Ok(Some(Curves { path, shape, counts, points, widths, interpolation, nurbs }))
    }

    /// Hands each strand of the prim to `add`.
    ///
    /// # Errors
    /// [`Error::Input`](crate::util::error::Error::Input) for knots that do not fit; any error of `add`.
    pub fn strands(
        &self,
        deviation: f32,
        told: &mut Told,
        file: &File,
        mut add: impl FnMut(Vec<(Vec3, f32)>) -> Result<()>,
    ) -> Result<()> {
        let (mut first, mut first_knot, mut first_of_knots) = (0, 0, 0);
        let one_order = self.nurbs.as_ref().is_some_and(|own| own.orders.len() == 1);
        for (number, count) in self.counts.iter().enumerate() {
            let places = first..first + count;
            let ends = self.shape.knots(*count);
            let has_own = self.interpolation == Interpolation::Vertex;
            let even = match self.interpolation {
                _ if self.widths.is_empty() => Some(0.0),
                Interpolation::Constant => Some(self.widths[0]),
                Interpolation::Uniform => Some(self.widths[number]),
                Interpolation::Varying | Interpolation::Vertex => None,
            };
            let width = |place: usize| even.unwrap_or(if has_own { self.widths[place] } else { 0.0 });
            let points: Vec<Vec4> = places.map(|place| self.points[place].extend(width(place))).collect();
            let varying = even.is_none() && !has_own;
            let knots = varying.then(|| &self.widths[first_knot..first_knot + ends]);
            let strand = match &self.nurbs {
                None if self.shape.segments(*count) == 0 => Vec::new(),
                None => self.shape.strand(&points, knots, deviation),
                Some(own) => {
                    let order = own.orders.get(if one_order { 0 } else { number }).copied().unwrap_or(0);
                    let end = first_of_knots + count.saturating_add(order);
                    let knots = own.knots.get(first_of_knots..end).unwrap_or_default();
                    let weights =
                        own.weights.as_ref().map(|own| own.get(first..first + count).unwrap_or_default());
                    first_of_knots = end;
                    let curve = Nurbs { order, knots, points: &points, weights };
                    if !curve.is_whole() {
                        let path = &self.path;
                        return Err(file
                            .broken(format!("{path}: the order or the knots of curve {number} do not fit")));
                    }
                    curve.strand(deviation)
                }
            };
            first += count;
            first_knot += ends;
            told.uneven += usize::from(self.nurbs.is_none() && self.shape.is_uneven(*count));
            told.without_width += usize::from(self.widths.is_empty());
            match strand.len() {
                0 | 1 => told.too_short += 1,
                _ => add(strand)?,
            }
        }
        Ok(())
    }
}

/// Points in the stage's space, all finite.
fn placed(path: &str, mut points: Vec<Vec3>, stage_from_own: &DAffine3, file: &File) -> Result<Vec<Vec3>> {
    for (number, point) in points.iter_mut().enumerate() {
        let own = *point;
        *point = stage_from_own.transform_point3(own.as_dvec3()).as_vec3();
        if !is_place(*point) {
            return Err(file.broken(format!("{path}.points: point {number} is {own}")));
        }
    }
    Ok(points)
}

/// Reads basis and wrap, whose defaults are those of USD.
fn shape(layer: &mut Layer, path: &str, time: Option<f64>, file: &mut File) -> Result<Shape> {
    let mut word = |name: &str, default: &str| -> Result<String> {
        let word = layer.attribute(path, name, time, file)?.as_deref().and_then(transform::word);
        Ok(word.unwrap_or_else(|| default.to_owned()))
    };
    let [kind, basis, wrap] =
        [word("type", "cubic")?, word("basis", "bezier")?, word("wrap", "nonperiodic")?];
    let unknown = |name: &str, word: &str| Err(file.broken(format!("{path}.{name} = {word:?} is not known")));
    let basis = match (kind.as_str(), basis.as_str()) {
        ("linear", _) => Basis::Linear,
        ("cubic", "bezier") => Basis::Bezier,
        ("cubic", "catmullRom") => Basis::CatmullRom,
        ("cubic", "bspline") => Basis::BSpline,
        ("cubic", other) => return unknown("basis", other),
        (other, _) => return unknown("type", other),
    };
    let wrap = match wrap.as_str() {
        "nonperiodic" => Wrap::Nonperiodic,
        "periodic" => Wrap::Periodic,
        "pinned" => Wrap::Pinned,
        other => return unknown("wrap", other),
    };
    Ok(Shape { basis, wrap })
}

/// Reads the widths of a prim, and where they stand: as its interpolation says, or else as their number fits.
fn widths(
    layer: &mut Layer,
    path: &str,
    shape: Shape,
    counts: &[usize],
    time: Option<f64>,
    file: &mut File,
) -> Result<(Vec<f64>, Interpolation)> {
    let mut name = "widths";
    // Indexed widths are those of another attribute, which no known program writes.
    if layer.has(&format!("{path}.primvars:widths"), "typeName")
        && !layer.has(&format!("{path}.primvars:widths:indices"), "typeName")
    {
        name = "primvars:widths";
    }
    let Some(widths) = numbers(layer, path, name, time, file)?.filter(|own| !own.is_empty()) else {
        return Ok((Vec::new(), Interpolation::Constant));
    };
    let said = match layer.field(&format!("{path}.{name}"), "interpolation", file)?.as_deref() {
        Some(Value::Token(word)) => match word.as_str() {
            "constant" => Interpolation::Constant,
            "uniform" => Interpolation::Uniform,
            "varying" | "faceVarying" => Interpolation::Varying,
            _ => Interpolation::Vertex,
        },
        _ => Interpolation::Vertex,
    };
    let fits = |own: &Interpolation| own.widths_of(shape, counts) == widths.len();
    let found = std::iter::once(said).chain(Interpolation::ALL).find(fits);
    let found = found.ok_or_else(|| {
        let (have, curves, points) = (widths.len(), counts.len(), counts.iter().sum::<usize>());
        file.broken(format!("{path}.{name}: there are {have} widths for {curves} curves of {points} points"))
    })?;
    Ok((widths, found))
}

/// An array of numbers of any precision.
fn numbers(
    layer: &mut Layer,
    path: &str,
    name: &str,
    time: Option<f64>,
    file: &mut File,
) -> Result<Option<Vec<f64>>> {
    Ok(match layer.attribute(path, name, time, file)?.as_deref() {
        Some(Value::HalfVec(own)) => Some(own.iter().map(|x| x.to_f64()).collect()),
        Some(Value::FloatVec(own)) => Some(own.iter().map(|x| f64::from(*x)).collect()),
        Some(Value::DoubleVec(own)) => Some(own.clone()),
        None | Some(Value::ValueBlock) => None,
        Some(_) => return Err(file.broken(format!("{path}.{name}: it is no array of numbers"))),
    })
}

/// An array of whole numbers that are not negative.
fn whole_numbers(
    layer: &mut Layer,
    path: &str,
    name: &str,
    time: Option<f64>,
    file: &mut File,
) -> Result<Option<Vec<usize>>> {
    Ok(match layer.attribute(path, name, time, file)?.as_deref() {
        Some(Value::IntVec(own)) => {
            let whole: std::result::Result<Vec<usize>, _> = own.iter().map(|n| usize::try_from(*n)).collect();
            Some(whole.map_err(|_| file.broken(format!("{path}.{name}: a number is negative")))?)
        }
        None | Some(Value::ValueBlock) => None,
        Some(_) => return Err(file.broken(format!("{path}.{name}: it is no array of whole numbers"))),
    })
}
