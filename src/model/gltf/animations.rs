//! Channels that move nodes.

use super::super::budget::Budget;
use super::super::paths::shorten;
use super::super::{Channel, Interpolation, Model, ModelAnimation, Pose, Target};
use super::accessor::Component;
use super::{Gltf, json};
use crate::util::error::Result;

impl Gltf<'_> {
    /// Reads the animations. Channels of anything but a node's pose are left out.
    pub fn read_animations(&self, model: &mut Model, budget: &mut Budget) -> Result<()> {
        let mut skipped = 0_u64;
        for (a, animation) in self.document.animations.iter().enumerate() {
            let mut channels = Vec::new();
            for (c, channel) in animation.channels.iter().enumerate() {
                let place = format!("animations[{a}].channels[{c}]");
                match self.channel(&place, animation, channel, model, budget)? {
                    Some(channel) => channels.push(channel),
                    None => skipped += 1,
                }
            }
            model.animations.push(ModelAnimation { name: animation.name.clone(), channels });
        }
        if skipped > 0 {
            model.note(format!("{skipped} channels of animation are ignored: they move no node"));
        }
        Ok(())
    }

    fn channel(
        &self,
        place: &str,
        animation: &json::Animation,
        channel: &json::Channel,
        model: &Model,
        budget: &mut Budget,
    ) -> Result<Option<Channel>> {
        let Some(node) = channel.target.node else { return Ok(None) };
        let (target, width) = match channel.target.path.as_str() {
            "translation" => (Target::Translation, 3),
            "rotation" => (Target::Rotation, 4),
            "scale" => (Target::Scale, 3),
            _ => return Ok(None),
        };
        let node = self.index(&format!("{place}.target.node"), node, model.nodes.len(), "nodes")?;
        if matches!(model.nodes[node].local, Pose::Matrix(_)) {
            return Err(self.fault(place, format!("nodes[{node}] has a matrix, which cannot be animated")));
        }
        let samplers = &animation.samplers;
        let index = self.index(&format!("{place}.sampler"), channel.sampler, samplers.len(), "samplers")?;
        let sampler = &samplers[index];
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(other) => {
                let why = format!("the interpolation {} is unknown", shorten(other));
                return Err(self.fault(place, why));
            }
        };
        let (input, output) = (format!("{place}: input"), format!("{place}: output"));
        let times = self.attribute(&input, sampler.input, &[1])?;
        let values = self.attribute(&output, sampler.output, &[width])?;
        let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        if times.count == 0 || values.count != times.count * per_key {
            let why = format!("{} values of {} keys", values.count, times.count);
            return Err(self.fault(place, why));
        }
        if times.component != Component::F32 {
            return Err(self.fault(&input, "the times are no floats"));
        }
        let bytes = times.count as u128 * 4 + values.count as u128 * 16;
        budget.take(bytes, || format!("{}: {place}", self.file.path.display()))?;
        let times: Vec<f32> = (0..times.count).map(|i| times.floats(i)[0]).collect();
        let values: Vec<[f32; 4]> = (0..values.count).map(|i| values.floats(i)).collect();
        if !times.iter().all(|t| t.is_finite()) || times.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(self.fault(&input, "the times do not rise"));
        }
        if !values.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(self.fault(&output, "a value is not finite"));
        }
        Ok(Some(Channel { node, target, interpolation, times, values }))
    }
}
