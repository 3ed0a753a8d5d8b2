//! Movements of the camera and of lights: turns drags in the picture into parameters of the scene.

use glam::{DQuat, DVec3};

use crate::picture::Camera;
use crate::scene::{Raw, Scene, SceneMesh, Values};

/// Steepest elevation of the camera, radians from the horizon. Straight up, left and right are undefined.
const STEEPEST: f64 = 1.553;
/// Least distance of the eye from the middle of what is framed, metres.
const NEAREST_M: f64 = 1e-3;

/// Position, target and field of view of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the eye, metres.
    pub eye: DVec3,
    /// The point in the middle of the image, metres.
    pub target: DVec3,
    /// Unit vector up in the world.
    pub up: DVec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_fov: f64,
}

impl Pose {
    /// Pose of the camera in a scene's values.
    pub fn of(values: &Values) -> Pose {
        let point = |key| values.point(key);
        Pose {
            eye: point("camera.eye"),
            target: point("camera.target"),
            up: point("camera.up").normalize_or(DVec3::Y),
            tan_half_fov: (f64::from(values.float("camera.fov")).to_radians() * 0.5).tan(),
        }
    }

    /// Keys and values of the camera parameters for this pose.
    pub fn edits(&self) -> [(&'static str, Raw); 2] {
        [("camera.eye", raw(self.eye)), ("camera.target", raw(self.target))]
    }

    /// Keys and values of the camera parameters that [`Pose::edits`] leaves as they are.
    pub fn lens_edits(&self) -> [(&'static str, Raw); 2] {
        let degrees = (2.0 * self.tan_half_fov.atan()).to_degrees();
        [("camera.up", raw(self.up)), ("camera.fov", Raw::Float(degrees))]
    }

    /// Pose of a camera that came from the file of a mesh, with its target at the distance of the mesh.
    pub fn with_camera(mut self, camera: &Camera, mesh: &SceneMesh) -> Pose {
        let middle = mesh.corners().map(|corners| corners.iter().sum::<DVec3>() / 8.0);
        let ahead = middle.map(|middle| (middle - camera.eye).dot(camera.forward));
        let distance = ahead.filter(|ahead| *ahead > NEAREST_M).unwrap_or(1.0);
        self.eye = camera.eye;
        self.target = camera.eye + camera.forward * distance;
        // A camera that does not lean orbits about the upright axis.
        self.up = if camera.right.y.abs() < 1e-4 && camera.up.y > 0.0 { DVec3::Y } else { camera.up };
        self.tan_half_fov = f64::from(camera.tan_half_fov);
        self
    }

    fn right(&self) -> DVec3 {
        (self.target - self.eye).cross(self.up).normalize_or(DVec3::X)
    }

    /// Unit vectors to the right of the image, up in it, and into it.
    pub fn axes(&self) -> [DVec3; 3] {
        let forward = (self.target - self.eye).normalize_or(-DVec3::Z);
        let right = self.right();
        [right, right.cross(forward).normalize_or(self.up), forward]
    }

    /// Turns the eye around the target: `yaw` to the left, `pitch` upwards, radians.
    pub fn orbit(mut self, yaw: f64, pitch: f64) -> Pose {
        let away = self.eye - self.target;
        let height = away.normalize_or(DVec3::Z).dot(self.up).clamp(-1.0, 1.0).asin();
        let pitch = (height + pitch).clamp(-STEEPEST, STEEPEST) - height;
        // A camera beyond the steepest elevation can only come back.
        let tilt = DQuat::from_axis_angle(self.right(), -pitch);
        let turn = DQuat::from_axis_angle(self.up, yaw);
        self.eye = self.target + turn * (tilt * away);
        self
    }

    /// Moves eye and target parallel to the image, by fractions of the image's height.
    pub fn pan(mut self, right: f64, up: f64) -> Pose {
        let away = self.target - self.eye;
        let height = 2.0 * self.tan_half_fov * away.length();
        let image_right = self.right();
        let image_up = image_right.cross(away).normalize_or(self.up);
        let by = (image_right * right + image_up * up) * height;
        self.eye += by;
        self.target += by;
        self
    }

    /// Multiplies the eye's distance from the target by `factor`.
    pub fn zoom(mut self, factor: f64) -> Pose {
        let away = self.eye - self.target;
        let length = (away.length() * factor).clamp(1e-2, 1e6);
        self.eye = self.target + away.normalize_or(DVec3::Z) * length;
        self
    }

    /// Looks at `point` from the same direction and distance.
    pub fn focus(mut self, point: DVec3) -> Pose {
        let by = point - self.target;
        self.target = point;
        self.eye += by;
        self
    }

    /// Moves the camera so that it sees the whole scene from the same direction, in a picture of this aspect.
    pub fn frame_all(self, scene: &Scene, aspect: f64) -> Pose {
        let corners =
            scene.quads.iter().flat_map(|q| q.corners).chain(scene.rocks.iter().flat_map(|r| r.corners));
        let mut points: Vec<DVec3> = corners.map(|c| scene.camera.origin + c.as_dvec3()).collect();
        points.extend(scene.meshes.iter().filter_map(SceneMesh::corners).flatten());
        self.frame(&points, aspect)
    }

    /// Moves the camera so that it sees all `points`, metres, from the same direction, in a picture of this
    /// aspect. Without points it stays.
    pub fn frame(mut self, points: &[DVec3], aspect: f64) -> Pose {
        let (Some(low), Some(high)) =
            (points.iter().copied().reduce(DVec3::min), points.iter().copied().reduce(DVec3::max))
        else {
            return self;
        };
        let centre = (low + high) * 0.5;
        let away = (self.eye - self.target).normalize_or(DVec3::Z);
        let forward = -away;
        let right = forward.cross(self.up).normalize_or(DVec3::X);
        let up = right.cross(forward);
        // At this distance the outermost point touches the image's edge.
        let distance = points.iter().map(|point| {
            let d = *point - centre;
            let wide = (d.dot(right).abs() / aspect.max(1e-3)).max(d.dot(up).abs());
            wide / self.tan_half_fov - d.dot(forward)
        });
        let distance = distance.fold(NEAREST_M, f64::max) * 1.05;
        self.target = centre;
        self.eye = centre + away * distance;
        self
    }
}

/// Turns a light's direction by `right` and `up`, radians, as seen by the camera.
pub fn turn_light(direction: DVec3, pose: &Pose, right: f64, up: f64) -> DVec3 {
    let turn = DQuat::from_axis_angle(pose.up, right);
    let tilt = DQuat::from_axis_angle(pose.right(), -up);
    (turn * (tilt * direction)).normalize_or(DVec3::Y)
}

/// Azimuth (from +z towards +x) and elevation of a direction, degrees.
pub fn angles(direction: DVec3) -> [f64; 2] {
    let d = direction.normalize_or(DVec3::Y);
    [d.x.atan2(d.z).to_degrees(), d.y.clamp(-1.0, 1.0).asin().to_degrees()]
}

/// Unit direction of an azimuth and elevation, degrees.
pub fn direction([azimuth, elevation]: [f64; 2]) -> DVec3 {
    let (a, e) = (azimuth.to_radians(), elevation.to_radians());
    DVec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos())
}

/// A vector as a value of a scene file, with the digits of a float32, or to a micrometre where those are too
/// few.
pub fn raw(v: DVec3) -> Raw {
    Raw::List(v.to_array().into_iter().map(|x| Raw::Float(short(x))).collect())
}

/// Rounds a coordinate so that its decimals are few and a distant place still moves smoothly.
fn short(x: f64) -> f64 {
    const STEPS_PER_M: f64 = 1e6;
    let single = (x as f32).to_string().parse().unwrap_or(x);
    if (single - x).abs() * STEPS_PER_M < 1.0 { single } else { (x * STEPS_PER_M).round() / STEPS_PER_M }
}
