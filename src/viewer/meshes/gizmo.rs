//! Places of the handles on a mesh, and what the pointer means on them.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use glam::{DQuat, DVec2, DVec3};

use crate::scene::{SceneMesh, Values, mesh_place, turn_of};
use crate::viewer::canvas::Canvas;

/// Radius of the rings in a large picture, points.
const RING: f64 = 68.0;
/// Distance of the arrows' tips from the middle, in radii of the rings.
pub(super) const TIP: f64 = 1.42;
/// Share of the picture's smaller side that the rings take at most.
const MOST: f64 = 0.16;
/// Pieces in which a ring is drawn.
pub(super) const PIECES: usize = 96;
/// Least cosine between a ring's axis and the line of sight at which the pointer is followed in the ring's
/// plane. A ring that is seen from its edge follows the pointer along its tangent.
const EDGE_ON: f64 = 0.2;
/// Room that a mark on the near side of a ring may have less than one on the far side, points.
const FAR_SIDE: f64 = 24.0;

/// Where a mesh stands, and the handles on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gizmo {
    pub position: DVec3,
    /// Degrees.
    pub turn: DVec3,
    pub scale: f64,
    /// Middle of the mesh in the space of its file, metres.
    pub local: DVec3,
    /// Middle of the mesh in the world, metres.
    pub middle: DVec3,
    /// Radius of the rings, points of the window.
    pub points: f64,
    /// The same at the middle of the mesh, metres.
    pub radius: f64,
}

impl Gizmo {
    pub fn of(values: &Values, mesh: &SceneMesh, canvas: &Canvas) -> Option<Gizmo> {
        let key = |what: &str| format!("meshes.{}.{what}", mesh.name);
        let [low, high] = mesh.loaded.bounds()?;
        let local = (low + high) * 0.5;
        let middle = mesh_place(values, &mesh.name).transform_point3(local);
        let side = f64::from(canvas.image.width().min(canvas.image.height()));
        let points = RING.min(side * MOST);
        let depth = canvas.view.project(middle).1;
        Some(Gizmo {
            position: values.point(&key("position")),
            turn: values.point(&key("turn")),
            scale: values.coordinate(&key("scale")),
            local,
            middle,
            points,
            radius: points * depth * canvas.view.metres_per_point(),
        })
    }

    /// Axis of the ring that turns the mesh by number `i` of its turn, and two axes across it.
    pub fn axes(&self, i: usize) -> [DVec3; 3] {
        let [_, y, z] = self.turn.to_array().map(f64::to_radians);
        let turned = match i {
            0 => DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y),
            1 => DQuat::from_rotation_z(z),
            _ => DQuat::IDENTITY,
        };
        [0, 1, 2].map(|k| turned * DVec3::AXES[(i + k) % 3])
    }

    /// Point of a ring at an angle, radians.
    pub fn on_ring(&self, i: usize, angle: f64) -> DVec3 {
        let [_, u, v] = self.axes(i);
        let (sin, cos) = angle.sin_cos();
        self.middle + (u * cos + v * sin) * self.radius
    }

    /// Position at which the mesh has its middle where it was, with another turn and scale.
    pub fn position_with(&self, turn: DVec3, scale: f64) -> DVec3 {
        // A mesh around its own origin does not move, not even by rounding.
        if self.local == DVec3::ZERO {
            return self.position;
        }
        self.middle - turn_of(turn) * (self.local * scale)
    }
}

impl Canvas<'_> {
    /// Distance along an axis through `from` to the point nearest to what is seen at a position, metres.
    /// `None` for an axis along the line of sight.
    pub(super) fn along(&self, from: DVec3, axis: DVec3, at: DVec2) -> Option<f64> {
        let sight = self.view.towards(at).normalize_or_zero();
        let (across, offset) = (axis.dot(sight), from - self.view.eye());
        let sine2 = 1.0 - across * across;
        (sine2 > 1e-4).then(|| (across * offset.dot(sight) - offset.dot(axis)) / sine2)
    }

    /// Angle of the pointer on ring `i`, radians. `None` if its plane does not meet the line of sight.
    pub(super) fn angle_on_ring(
        &self,
        gizmo: &Gizmo,
        i: usize,
        pressed: DVec2,
        pointer: DVec2,
    ) -> Option<f64> {
        let [axis, u, v] = gizmo.axes(i);
        let to_middle = gizmo.middle - self.view.eye();
        if axis.dot(to_middle.normalize_or_zero()).abs() < EDGE_ON {
            return self.angle_by_tangent(gizmo, i, pressed, pointer);
        }
        let sight = self.view.towards(pointer);
        let along = to_middle.dot(axis) / sight.dot(axis);
        let d = sight * along - to_middle;
        (along > 0.0 && d.is_finite()).then(|| d.dot(v).atan2(d.dot(u)))
    }

    /// Angle by the way of the pointer along a ring's tangent at the point where it was pressed.
    fn angle_by_tangent(&self, gizmo: &Gizmo, i: usize, pressed: DVec2, pointer: DVec2) -> Option<f64> {
        let angles = (0..PIECES).map(|k| TAU * k as f64 / PIECES as f64);
        let place = |angle: f64| self.view.project(gizmo.on_ring(i, angle));
        let far = |angle: f64| place(angle).0.map_or(f64::INFINITY, |at| at.distance(pressed));
        // Seen from its edge, a ring has two points at most places: the nearer one is meant.
        let nearest = angles.clone().map(far).fold(f64::INFINITY, f64::min);
        let meant = angles.filter(|angle| far(*angle) <= nearest + 2.0);
        let angle = meant.min_by(|a, b| place(*a).1.total_cmp(&place(*b).1))?;
        let step = TAU / PIECES as f64;
        let tangent = (place(angle + step).0? - place(angle - step).0?) / (2.0 * step);
        let along = (pointer - pressed).dot(tangent) / tangent.length_squared().max(1.0);
        Some(angle + along)
    }

    /// Position of the point that marks ring `i`: halfway between the two others, where it is farthest from
    /// the arrows' tips, and rather on the near side.
    pub(super) fn knob(&self, gizmo: &Gizmo, i: usize) -> Option<DVec2> {
        let [_, u, v] = gizmo.axes(i);
        let (middle, deep) = self.view.project(gizmo.middle);
        let tips = DVec3::AXES.map(|axis| self.view.project(gizmo.middle + axis * (gizmo.radius * TIP)).0);
        let others: Vec<DVec2> = tips.into_iter().chain([middle]).flatten().collect();
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let points = signs.into_iter().filter_map(|[a, b]| {
            let (at, depth) =
                self.view.project(gizmo.middle + (u * a + v * b) * (gizmo.radius * FRAC_1_SQRT_2));
            let at = at?;
            let room = others.iter().map(|other| other.distance(at)).fold(f64::INFINITY, f64::min);
            Some((at, room - if depth > deep { FAR_SIDE } else { 0.0 }))
        });
        points.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
    }
}
