//! Scattering lobes: the distribution of a cell's reflection over directions, for one light. These are the
//! numbers behind the plot in the parameter panel.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use super::lights::shines;
use crate::light::Reflection;
use crate::light::environment::luminance;
use crate::light::fibre::{fibre_angles, specular_power};
use crate::light::strand::{Lobes, Strand, cell_aeration};
use crate::scene::{Scene, Values};

/// Directions around a plot: one per degree, less than half the standard deviation of the narrowest lobe.
pub const STEPS: usize = 360;
/// Most powers of ten from the middle of a plot to its rim.
pub const DECADES: i32 = 4;

/// The circle of directions to the eye over which the lobes are drawn. The angle α gives a direction on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// The mirror cone θ_o = −θ_i around the strand. α is the azimuth φ, which is 0 at the light.
    #[default]
    Around,
    /// The plane of strand and light. cos α is the direction's component across the strand towards the light,
    /// sin α its component along the strand. θ_o = α and φ = 0 on the light's side, θ_o = ±π − α and φ = π on
    /// the other.
    Along,
}

impl Plane {
    /// Returns θ_o and φ at `alpha` (−π to π), for a light of inclination `theta_i`. All angles are in
    /// radians.
    pub fn direction(self, theta_i: f64, alpha: f64) -> (f64, f64) {
        match self {
            Plane::Around => (-theta_i, alpha),
            Plane::Along if alpha.abs() <= 0.5 * PI => (alpha, 0.0),
            Plane::Along => (PI.copysign(alpha) - alpha, PI),
        }
    }
}

/// Everything that the lobes depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Reflection model.
    pub reflection: Reflection,
    /// Diffuse reflection coefficient of the cell.
    pub k_d: f32,
    /// Specular reflection coefficient of the cell.
    pub k_s: f32,
    /// Exponent p of the fibre model's specular term.
    pub p: f32,
    /// Inclination θ_i of the light to the plane across the strand, radians, −π/2 to π/2.
    pub theta_i: f64,
    /// Directions to the eye.
    pub plane: Plane,
}

impl Setting {
    /// Setting of the cells of `scene` without their noise, and of a light of inclination `theta_i`, radians.
    pub fn new(scene: &Scene, theta_i: f64, plane: Plane) -> Setting {
        let (k_d, k_s) = (scene.recipes[0].water.k_d, scene.recipes[0].water.k_s);
        Setting { reflection: scene.reflection, k_d, k_s, p: scene.p, theta_i, plane }
    }
}

/// One lobe.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: &'static str,
    /// Description.
    pub doc: &'static str,
    /// Luminance of Φ, 1/sr, at α = i·360°/[`STEPS`].
    pub values: Vec<f64>,
}

impl Curve {
    /// The largest value, 1/sr.
    pub fn peak(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }
}

/// Angle α of direction number `step` of a plot, radians, −π to π.
pub fn alpha(step: usize) -> f64 {
    let turn = step % STEPS;
    let signed = if 2 * turn > STEPS { turn as f64 - STEPS as f64 } else { turn as f64 };
    signed * (2.0 * PI / STEPS as f64)
}

/// Computes the lobes. The last curve is their sum. Those of a strand take about 30 ms.
pub fn curves(setting: &Setting) -> Vec<Curve> {
    match setting.reflection {
        Reflection::KajiyaKay => fibre(setting),
        Reflection::Strand(mut params) | Reflection::Hair(mut params) => {
            params.aeration = cell_aeration(params.aeration, setting.k_d, setting.k_s);
            strand(&Strand::new(&params), setting)
        }
    }
}

/// Name, description and value of one part of a lobe `T`.
type Part<T> = (&'static str, &'static str, fn(&T) -> f64);

/// Lobes of the strand model: Φ, 1/sr.
fn strand(strand: &Strand, setting: &Setting) -> Vec<Curve> {
    let parts: [Part<Lobes>; 6] = [
        ("R", "Reflected off the outside of the strand", |l| luminance(l.r)),
        ("TT", "Transmitted through the strand", |l| luminance(l.tt)),
        ("TRT", "Reflected once inside the strand: the rainbow, or the coloured highlight of hair", |l| {
            luminance(l.trt)
        }),
        ("rest", "Reflected inside the strand twice or more", |l| luminance(l.residual)),
        ("aerated", "Scattered by air bubbles", |l| luminance(l.aerated)),
        ("total", "Φ, the sum", |l| luminance(l.total())),
    ];
    let at = |(theta_o, phi)| strand.lobes(setting.theta_i, theta_o, phi);
    sampled(&parts, setting, at)
}

/// Lobes of the fibre model: Ψ/π, 1/sr, comparable to the strand's Φ.
fn fibre(setting: &Setting) -> Vec<Curve> {
    let parts: [Part<[f64; 2]>; 3] = [
        ("diffuse", "k_d·sin(t,l)/π", |[d, _]| *d),
        ("specular", "k_s·max(0, sin(t,l)·sin(t,e) − (t·l)(t·e))^p/π", |[_, s]| *s),
        ("total", "Ψ/π, the sum", |[d, s]| d + s),
    ];
    let at = |(theta_o, _): (f64, f64)| {
        let (sin_l, base) = fibre_angles(setting.theta_i.sin() as f32, theta_o.sin() as f32, 1.0);
        let specular = setting.k_s * specular_power(base.max(0.0), setting.p);
        [setting.k_d * sin_l, specular].map(|x| f64::from(x) * FRAC_1_PI)
    };
    sampled(&parts, setting, at)
}

fn sampled<T>(parts: &[Part<T>], setting: &Setting, at: impl Fn((f64, f64)) -> T) -> Vec<Curve> {
    let lobes: Vec<T> = (0..STEPS).map(|i| at(setting.plane.direction(setting.theta_i, alpha(i)))).collect();
    let curve = |(name, doc, part): &Part<T>| Curve { name, doc, values: lobes.iter().map(part).collect() };
    parts.iter().map(curve).collect()
}

/// Radial scale of a polar plot. It is logarithmic, so that lobes a hundred times weaker are visible as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Power of ten in the middle of the plot.
    pub middle: i32,
    /// log10 of the value at the rim, which is the largest value.
    pub rim: f64,
}

impl Scale {
    /// Creates the scale of some curves.
    pub fn new(curves: &[Curve]) -> Scale {
        let peak = curves.iter().map(Curve::peak).fold(0.0, f64::max);
        let rim = if peak > 0.0 && peak.is_finite() { peak.log10() } else { 0.0 };
        Scale { middle: rim.ceil() as i32 - DECADES, rim }
    }

    /// Radius of a value, 0 to 1. It is 0 for values up to the power of ten in the middle.
    pub fn radius(self, value: f64) -> f64 {
        let middle = f64::from(self.middle);
        ((value.log10() - middle) / (self.rim - middle)).max(0.0)
    }

    /// The powers of ten between middle and rim, with their radii.
    pub fn rings(self) -> impl Iterator<Item = (i32, f64)> {
        let last = self.rim.floor() as i32;
        (self.middle + 1..=last).map(move |power| (power, self.radius(10f64.powi(power))))
    }
}

/// Direction of a light relative to the flow of the first quad.
#[derive(Clone, Debug, PartialEq)]
pub struct Incidence {
    /// Name of the light.
    pub light: String,
    /// Inclination θ_i of the light to the plane across the flow, radians. Positive if the flow goes towards
    /// the light.
    pub theta_i: f64,
}

/// Incidence of the selected light. Without a selection it is that of the first light that shines, else of
/// the sky's sun, else of the first light. Returns `None` without lights, or if the light is exactly at the
/// middle of the quad.
pub fn incidence(scene: &Scene, values: &Values, selected: Option<&str>) -> Option<Incidence> {
    let names = values.names("lights");
    let preferred = selected.or_else(|| names.iter().find(|name| shines(values, name)).map(String::as_str));
    let sun = scene.environment.as_ref().and_then(|e| e.sun);
    let (light, to_light) = match (preferred, sun, names.first()) {
        (Some(name), ..) => (name, to_light(scene, values, name)),
        (None, Some(sun), _) => ("the sky's sun", sun.to_sun.as_dvec3()),
        (None, None, Some(first)) => (first.as_str(), to_light(scene, values, first)),
        (None, None, None) => return None,
    };
    let sin = flow(scene).dot(to_light.try_normalize()?);
    Some(Incidence { light: light.to_owned(), theta_i: sin.clamp(-1.0, 1.0).asin() })
}

/// Unit direction of the flow: v of the first quad at its middle. Down if there are no quads.
pub fn flow(scene: &Scene) -> DVec3 {
    let down = scene.quads.first().map(|quad| {
        let [a, b, c, d] = quad.corners.map(|p| p.as_dvec3());
        (d - a + c - b).normalize_or(DVec3::NEG_Y)
    });
    down.unwrap_or(DVec3::NEG_Y)
}

/// Direction from the middle of the first quad to a light, not normalised.
fn to_light(scene: &Scene, values: &Values, name: &str) -> DVec3 {
    let triple = |what: &str| values.point(&format!("lights.{name}.{what}"));
    if values.text(&format!("lights.{name}.kind")) == "directional" {
        return triple("direction");
    }
    let middle = scene
        .quads
        .first()
        .map_or(DVec3::ZERO, |quad| quad.corners.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / 4.0);
    triple("position") - (scene.camera.origin + middle)
}
