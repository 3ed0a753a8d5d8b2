//! Animations of nodes: samplers of translation, rotation and scale (glTF 2.0, §3.11 and appendix C).

use glam::{DAffine3, DQuat, DVec3, DVec4};

use super::Model;

/// Transform of a node to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pose {
    /// Scale, then rotation, then translation. Only such a pose can be animated.
    Parts {
        /// Translation, metres.
        translation: DVec3,
        /// Rotation, a unit quaternion.
        rotation: DQuat,
        /// Scale along the node's axes.
        scale: DVec3,
    },
    /// A matrix.
    Matrix(DAffine3),
}

impl Default for Pose {
    fn default() -> Self {
        Pose::Parts { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE }
    }
}

impl Pose {
    /// Returns the pose as a matrix.
    pub fn matrix(&self) -> DAffine3 {
        match *self {
            Pose::Parts { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
            Pose::Matrix(matrix) => matrix,
        }
    }
}

/// Animation of nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelAnimation {
    /// Name in the file. It may be empty.
    pub name: String,
    /// Channels. Each moves one part of one node's pose.
    pub channels: Vec<Channel>,
}

/// Curve of one part of a node's pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Index of the node.
    pub node: usize,
    /// Part of the pose.
    pub target: Target,
    /// Interpolation between keys.
    pub interpolation: Interpolation,
    /// Times of the keys, s; they rise.
    pub times: Vec<f32>,
    /// Values: one for each key, or tangent, value and tangent of a cubic spline. The last component is
    /// unused but for rotations.
    pub values: Vec<[f32; 4]>,
}

/// Part of a pose that a channel moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Translation.
    Translation,
    /// Rotation.
    Rotation,
    /// Scale.
    Scale,
}

/// Interpolation between the keys of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interpolation {
    /// A key holds until the next.
    Step,
    /// Straight line, or great arc of rotations.
    Linear,
    /// Cubic Hermite spline.
    Cubic,
}

impl ModelAnimation {
    /// Returns the times of the first and the last key, s.
    pub fn range(&self) -> Option<[f32; 2]> {
        let ends = self.channels.iter().filter_map(|c| Some([*c.times.first()?, *c.times.last()?]));
        ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}

impl Channel {
    /// Returns the value at `time`, s. The first and the last key hold beyond the ends.
    pub fn sample(&self, time: f64) -> DVec4 {
        let key = |i: usize, part: usize| -> DVec4 {
            let at = if self.interpolation == Interpolation::Cubic { 3 * i + part } else { i };
            DVec4::from(self.values[at].map(f64::from))
        };
        let last = self.times.len() - 1;
        let after = self.times.partition_point(|&t| f64::from(t) <= time);
        if after == 0 || after > last {
            return self.normalised(key(if after == 0 { 0 } else { last }, 1));
        }
        let (a, b) = (after - 1, after);
        let length = f64::from(self.times[b]) - f64::from(self.times[a]);
        let t = (time - f64::from(self.times[a])) / length;
        let value = match self.interpolation {
            Interpolation::Step => key(a, 1),
            Interpolation::Linear if self.target == Target::Rotation => {
                let [from, to] = [key(a, 1), key(b, 1)].map(DQuat::from_vec4);
                from.normalize().slerp(to.normalize(), t).into()
            }
            Interpolation::Linear => key(a, 1).lerp(key(b, 1), t),
            Interpolation::Cubic => {
                let (t2, t3) = (t * t, t * t * t);
                key(a, 1) * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + key(a, 2) * (length * (t3 - 2.0 * t2 + t))
                    + key(b, 1) * (3.0 * t2 - 2.0 * t3)
                    + key(b, 0) * (length * (t3 - t2))
            }
        };
        self.normalised(value)
    }

    /// Rotations of unit length; other values as they are.
    fn normalised(&self, value: DVec4) -> DVec4 {
        match self.target {
            Target::Rotation => value.try_normalize().unwrap_or(DVec4::W),
            _ => value,
        }
    }
}

impl Model {
    /// Returns the transform from a node's space to the world at `time`, s, of an animation. Nodes that the
    /// animation does not move are at rest.
    ///
    /// The channels are searched for each node on the way to the root: this is made for a few nodes, such as
    /// cameras, and not for all of a large file.
    pub fn world_at(&self, animation: usize, node: usize, time: f64) -> DAffine3 {
        let channels = &self.animations[animation].channels;
        let mut world = DAffine3::IDENTITY;
        let mut next = Some(node);
        while let Some(index) = next {
            let mut pose = self.nodes[index].local;
            if let Pose::Parts { translation, rotation, scale } = &mut pose {
                for channel in channels.iter().filter(|channel| channel.node == index) {
                    let value = channel.sample(time);
                    match channel.target {
                        Target::Translation => *translation = value.truncate(),
                        Target::Rotation => *rotation = DQuat::from_vec4(value),
                        Target::Scale => *scale = value.truncate(),
                    }
                }
            }
            world = pose.matrix() * world;
            next = self.nodes[index].parent;
        }
        world
    }

    /// Tells whether an animation moves a node or one of those it stands on.
    pub fn is_moved(&self, animation: usize, node: usize) -> bool {
        let channels = &self.animations[animation].channels;
        let mut next = Some(node);
        while let Some(index) = next {
            if channels.iter().any(|channel| channel.node == index) {
                return true;
            }
            next = self.nodes[index].parent;
        }
        false
    }
}
