//! Boxes of a scene, which show a volume once, and the eye inside them.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

use serde_json::{Value as Json, json};

use super::meshes::turn_of;
use super::param::POINT_MAX;
use super::{Parts, Recipe, Values};
use crate::light::{Scattering, Visibility};
use crate::mapping::shell::{HullFace, Inside, Shell, ShellFault};
use crate::trace::AttenuationKind;
use crate::util::error::{Error, Result};
use crate::volume::{VelocityNames, VolumeTexture};

/// Cells between the corners where V and shadows are kept, along x and y. With 16, the limit of shells,
/// shadows of smoke are visibly coarse; with 4, V takes four times as much memory and the paths of rays have
/// twice as many tetrahedra.
const CELLS_A_SQUARE: u32 = 8;
/// Largest number of boxes. Every ray may enter each of them, and the shader looks a face's shell up among
/// all.
const MAX_BOXES: usize = 4096;

/// Distance of the face of an eye inside a box, in distances of the near plane, so that it is not cut there.
const BEHIND_NEAR: f64 = 1.01;
/// Distance from the middle of the view to its sides on that face, in half images: more than samples and
/// filters reach.
const BEYOND_VIEW: f64 = 1.5;

/// A box of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneBox {
    /// Name in the scene.
    pub name: String,
    /// Number of its volume.
    pub volume: u32,
    /// Transform from texture coordinates, 0 to 1 along x, y and z of the volume, to the world, metres.
    pub world_from_texture: DAffine3,
}

/// Returns the names of the volumes in boxes.
pub(super) fn volumes(v: &Values) -> impl Iterator<Item = String> {
    v.names("boxes").into_iter().map(|name| v.text(&format!("boxes.{name}.volume")))
}

impl SceneBox {
    fn read(v: &Values, name: &str, recipes: &[Recipe]) -> Result<SceneBox> {
        let key = |what: &str| format!("boxes.{name}.{what}");
        let volume = v.text(&key("volume"));
        let number = recipes.iter().position(|recipe| recipe.name == volume);
        let number = number.expect("a volume that a box shows has a recipe");
        let recipe = &recipes[number];
        let own = recipe.world_from_texture().unwrap_or_else(|| VolumeTexture::unit_box(recipe.water.size));
        let is_moved =
            |key: &String| v.is_set(key) && (!key.ends_with(".turn") || v.point(key) != DVec3::ZERO);
        let moved = ["position", "size", "turn"].map(key).into_iter().find(is_moved);
        if let Some(moved) = moved.filter(|_| recipe.is_sequence && recipe.world_from_texture().is_some()) {
            return Err(Error::input(
                format!("{moved}: the volume {volume} is a sequence, whose bounds change from file to file"),
                format!(
                    "leave {moved} out: each file stands where the simulation was; move the rest instead"
                ),
            ));
        }
        let mut axes = own.matrix3;
        if v.is_set(&key("size")) {
            let size = v.point(&key("size"));
            if size.min_element() <= 0.0 {
                return Err(Error::input(
                    format!("{} = {size}: a side has no length", key("size")),
                    "give three lengths above 0, metres",
                ));
            }
            let side = |axis: DVec3, length: f64| axis.normalize_or_zero() * length;
            let DMat3 { x_axis, y_axis, z_axis } = axes;
            axes = DMat3::from_cols(side(x_axis, size.x), side(y_axis, size.y), side(z_axis, size.z));
        }
        axes = DMat3::from_quat(turn_of(v.point(&key("turn")))) * axes;
        let middle = match v.is_set(&key("position")) {
            true => v.point(&key("position")),
            false => own.transform_point3(DVec3::splat(0.5)),
        };
        let half = axes * DVec3::splat(0.5);
        let place = DAffine3 { matrix3: axes, translation: middle - half };
        let far =
            place.translation.abs().max_element() + axes.to_cols_array().map(f64::abs).iter().sum::<f64>();
        if !far.is_finite() || far > POINT_MAX {
            return Err(Error::input(
                format!("box {name} reaches {far:.3e} m from the scene's origin"),
                format!(
                    "a scene's points lie within ±{POINT_MAX:e} m: give {} and {}",
                    key("position"),
                    key("size")
                ),
            ));
        }
        Ok(SceneBox { name: name.into(), volume: number as u32, world_from_texture: place })
    }

    /// The middle of the box, metres.
    pub fn middle(&self) -> DVec3 {
        self.world_from_texture.transform_point3(DVec3::splat(0.5))
    }

    /// Lengths of the sides along x, y and z of the volume, metres.
    pub fn sides(&self) -> DVec3 {
        let DMat3 { x_axis, y_axis, z_axis } = self.world_from_texture.matrix3;
        DVec3::new(x_axis.length(), y_axis.length(), z_axis.length())
    }

    /// Lists the box in a comment of a scene file.
    pub(super) fn comment(&self, recipe: &Recipe) -> String {
        let ([a, b, c], at) = (self.sides().to_array(), self.middle());
        let mut text = format!(
            "\n# box {}: volume {}, {a:.4} × {b:.4} × {c:.4} m around [{:.4}, {:.4}, {:.4}]",
            self.name, recipe.name, at.x, at.y, at.z
        );
        if recipe.knows_size() {
            let [nx, ny, nz] = recipe.water.size;
            text += &format!(", {nx} × {ny} × {nz} cells");
        }
        if let Some(measured) = &recipe.measured {
            let [x, y, z] = measured.bounds.size();
            let velocity = match &measured.velocity {
                VelocityNames::None => "no velocity".into(),
                VelocityNames::Vector(name) => format!("velocity {name}"),
                VelocityNames::Components(names) => format!("velocity {}", names.join(", ")),
            };
            text += &format!("\n#   from {x} × {y} × {z} voxels: density {}, {velocity}", measured.density);
        }
        text.replace(['\r'], " ") + "\n"
    }

    /// Lists the box in JSON.
    pub(super) fn json(&self, recipe: &Recipe) -> Json {
        let DAffine3 { matrix3, translation } = self.world_from_texture;
        let axes = [matrix3.x_axis, matrix3.y_axis, matrix3.z_axis].map(|axis| axis.to_array());
        json!({
            "name": self.name,
            "volume": recipe.name,
            "corner": translation.to_array(),
            "axes": axes,
        })
    }

    /// The shell that fills the box, relative to `origin`. `squares` are those of [`Shell::block`].
    fn shell(&self, origin: DVec3, squares: [u32; 2]) -> Result<Shell> {
        let DMat3 { x_axis, y_axis, z_axis } = self.world_from_texture.matrix3;
        let corner = self.world_from_texture.translation - origin;
        let mut shell = Shell::block(corner, [x_axis, y_axis, z_axis], squares).map_err(|fault| {
            let what = match fault {
                ShellFault::Empty | ShellFault::Unmapped => "is flat: two of its sides are parallel",
                ShellFault::TooLarge => "has too many cells for light at their corners",
                ShellFault::NotFinite => "has a corner that is not a finite number",
            };
            let name = &self.name;
            Error::input(
                format!("box {name} {what}"),
                format!("give boxes.{name}.size, or mend the volume's file"),
            )
        })?;
        shell.volume = self.volume;
        Ok(shell)
    }
}

/// Reads the boxes of a scene, whose volumes have these recipes.
///
/// # Errors
/// [`Error::Input`] where a box is flat or too far away, or the scene's settings do not go with boxes.
pub(super) fn read(v: &Values, recipes: &[Recipe]) -> Result<Vec<SceneBox>> {
    let names = v.names("boxes");
    let Some(first) = names.first() else { return Ok(Vec::new()) };
    let bad = |what: &str, fix: &str| Err(Error::input(format!("box {first}: a box {what}"), fix));
    if names.len() > MAX_BOXES {
        let what = format!("the scene has {} boxes", names.len());
        return Err(Error::input(what, format!("at most {MAX_BOXES}")));
    }
    if v.choice("trace.attenuation", AttenuationKind::from_word) == AttenuationKind::PerCell {
        return bad(
            "needs attenuation by length, and trace.attenuation is \"per-cell\"",
            "set trace.attenuation=path-length with a trace.sigma",
        );
    }
    if v.choice("light.scattering", Scattering::from_word) == Scattering::Multiple {
        return bad(
            "has no multiple scattering, which quads and the shells of meshes have",
            "set light.scattering=single",
        );
    }
    names.iter().map(|name| SceneBox::read(v, name, recipes)).collect()
}

/// Builds the shells of boxes, relative to `origin`.
///
/// # Errors
/// [`Error::Input`] where a box is flat.
pub(super) fn shells(
    v: &Values,
    boxes: &[SceneBox],
    origin: DVec3,
    recipes: &[Recipe],
) -> Result<Vec<Arc<Shell>>> {
    let is_kept = v.choice("light.visibility", Visibility::from_word) == Visibility::Cached;
    // Shadows of opaque matter are kept at the corners too.
    let is_cut = is_kept || ["rocks", "meshes"].iter().any(|section| !v.names(section).is_empty());
    let shell = |own: &SceneBox| {
        let recipe = &recipes[own.volume as usize];
        let [nx, ny, _] = recipe.water.size;
        // Nobody knows the size of a volume file before it is read.
        let squares = match is_cut && recipe.knows_size() {
            true => [nx, ny].map(|n| n.div_ceil(CELLS_A_SQUARE)),
            false => [1, 1],
        };
        own.shell(origin, squares).map(Arc::new)
    };
    boxes.iter().map(shell).collect()
}

impl Parts {
    /// The place of the eye in a shell, if that is a box around it.
    pub fn eye_inside(&self, shell: &Shell) -> Option<Inside> {
        shell.eye_inside(self.camera.eye_local())
    }

    /// Corners of a triangle that covers the whole view just behind the near plane, metres. It stands for the
    /// face of a box around the eye.
    pub fn eye_face(&self) -> [Vec3; 3] {
        let [forward, right, up] = self.camera.rays(self.image.width, self.image.height);
        let eye = self.camera.eye_local();
        // Positions are rounded to float32.
        let metres = f64::from(self.camera.near) * BEHIND_NEAR + 1e-5 * eye.length();
        [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|at: [f64; 2]| {
            let [x, y] = at.map(|c| c * BEYOND_VIEW);
            (eye + (forward + right * x + up * y) * metres).as_vec3()
        })
    }

    /// Corners of a face of a shell's hull, metres, and their texture coordinates. Those of the face of the
    /// eye are 0.
    pub fn hull_corners(&self, shell: &Shell, face: &HullFace) -> ([Vec3; 3], [Vec2; 3]) {
        match face.is_eye() {
            true => (self.eye_face(), [Vec2::ZERO; 3]),
            false => (shell.corners(face), face.points.map(|point| shell.uv(face, point))),
        }
    }

    /// Corners of the faces of a shell's hull that face the eye, by their numbers in the hull.
    pub fn seen_hull<'a>(&self, shell: &'a Shell) -> impl Fn(&HullFace) -> Option<[Vec3; 3]> + Sync + 'a {
        let eye = self.camera.eye_local();
        let around = self.eye_inside(shell).map(|_| self.eye_face());
        move |face: &HullFace| {
            if face.is_eye() {
                return around;
            }
            let corners = shell.corners(face);
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            ((b - a).cross(c - a).dot(a - eye) < 0.0).then_some(corners)
        }
    }
}
