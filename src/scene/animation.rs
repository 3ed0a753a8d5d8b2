//! A scene in time, as one scene for each frame.
//!
//! The scene of a frame depends only on the animation and the number of the frame. In a loop of N frames,
//! frame f is frame f mod N, so frame N equals frame 0 to the last bit. Frames before 0 are as good
//! as others.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};

use super::keyframes::{CameraPath, Interpolation, Keyframes};
use super::names::check_names;
use super::param::{Kind, Param, split_volume_key};
use super::read::{Source, apply_sets};
use super::sequence::Sequence;
use super::value::{Place, Raw, Value, Values};
use super::{Limits, Record, Scene, expose, meshes, volumes};
use crate::util::error::{Error, Result};

/// Keys of the camera that do not move it.
const OF_LENS: [&str; 4] = ["camera.f_number", "camera.focus", "camera.near", "camera.shutter"];

/// A scene and its motion.
#[derive(Clone, Debug)]
pub struct Animation {
    name: String,
    /// Values as read, including all keys under `animate`.
    values: Values,
    /// Folder in which references resolve; without one they are trusted.
    folder: Option<PathBuf>,
    limits: Limits,
    /// Frames per second.
    pub fps: f64,
    /// Length, frames.
    pub frames: u32,
    /// Length of the loop, frames, if the animation is one.
    pub period: Option<u32>,
    /// Speed of the flow as a fraction: lengths of the volume over frames. Whole lengths close a loop
    /// exactly.
    flow: (f64, f64),
    /// Frames in one turn of the camera; 0 for no turn.
    turn: i64,
    tracks: Vec<(String, Keyframes)>,
    path: Option<CameraPath>,
    /// Measured stops, which replace the automatic exposure.
    measured: Option<f32>,
    /// Record of the picture that the scene was read from.
    record: Option<Record>,
}

impl Animation {
    /// Reads a preset or file, applies the `--set`s in order, and checks the motion.
    ///
    /// # Errors
    /// [`Error::Usage`] where a `--set` has no value, [`Error::Io`] where a file cannot be read, and the
    /// errors of [`Animation::new`].
    pub fn load(scene: &Path, sets: &[String], limits: &Limits) -> Result<Animation> {
        let source = Source::find(scene)?;
        let mut values = source.values()?;
        let record = Record::of(&source.text, &mut values);
        let folder = apply_sets(&mut values, sets, &source, limits)?;
        record.as_ref().map_or(Ok(()), |record| record.check_map(&values))?;
        Ok(Animation { record, ..Animation::new(&source.name, values, folder, limits)? })
    }

    /// Makes the animation of values that the table accepted. The scenes of its frames are not checked yet.
    ///
    /// # Errors
    /// [`Error::Input`] where the keyframes, the camera's path, its turn and the loop do not fit one another.
    pub fn new(name: &str, values: Values, folder: Option<PathBuf>, limits: &Limits) -> Result<Animation> {
        let period = Some(values.count("animate.loop")).filter(|&n| n > 0);
        let frames = period.unwrap_or(values.count("animate.frames"));
        let (fps, speed) = (number(&values, "animate.fps"), number(&values, "animate.speed"));
        let turn = values.int("animate.turn");
        if let Some(n) = period
            && turn != 0
            && i64::from(n) % turn != 0
        {
            return Err(Error::input(
                format!("animate.loop = {n} does not hold whole turns of animate.turn = {turn} frames"),
                "make the loop a multiple of the turn",
            ));
        }
        let flow = flow(speed, fps, period);
        let mut tracks: Vec<(String, Keyframes)> = Vec::new();
        for i in values.names("animate.tracks") {
            let (key, track) = track(&values, &format!("animate.tracks.{i}"), period)?;
            if tracks.iter().any(|(other, _)| *other == key) {
                return Err(Error::input(
                    format!("animate.tracks.{i}: another track moves {key} too"),
                    "put the keyframes of both into one",
                ));
            }
            tracks.push((key, track));
        }
        let path = path(&values, frames, period)?;
        if path.is_some() && turn != 0 {
            return Err(Error::input(
                "animate.path and animate.turn both move the camera",
                "remove one, or set animate.turn = 0",
            ));
        }
        let from = values.text("camera.from");
        let moves_camera =
            |(key, _): &(String, Keyframes)| key.starts_with("camera.") && !OF_LENS.contains(&key.as_str());
        if !from.is_empty() && (path.is_some() || turn != 0 || tracks.iter().any(moves_camera)) {
            return Err(Error::input(
                format!("camera.from = {from:?} and the animation both move the camera"),
                "remove camera.from, or animate.path, animate.turn and tracks of the camera",
            ));
        }
        for (key, _) in &tracks {
            let taken = match key.as_str() {
                "camera.eye" => path.is_some() || turn != 0,
                "camera.target" => path.as_ref().is_some_and(CameraPath::has_targets),
                _ => false,
            };
            if taken {
                return Err(Error::input(
                    format!("a track of {key} and animate.path or animate.turn both move the camera"),
                    "remove one",
                ));
            }
        }
        Ok(Animation {
            name: name.into(),
            values,
            folder,
            limits: limits.clone(),
            fps,
            frames,
            period,
            flow,
            turn,
            tracks,
            path,
            measured: None,
            record: None,
        })
    }

    /// Returns the scene's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the limits that the command line sets.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Returns the values as read. Frame 0 has them where nothing moves.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Returns the animation with other values for some keys.
    ///
    /// # Errors
    /// The errors of [`Values::set`] and [`Animation::new`].
    pub fn with(&self, changes: &[(String, Raw, Place)]) -> Result<Animation> {
        let mut values = self.values.clone();
        changes.iter().try_for_each(|(key, raw, place)| values.set(key, raw, place))?;
        let animation = Animation::new(&self.name, values, self.folder.clone(), &self.limits)?;
        Ok(Animation { measured: self.measured, record: self.record.clone(), ..animation })
    }

    /// Replaces the automatic exposure by `stops` added to the exposure of every frame.
    pub fn exposed(self, stops: f32) -> Animation {
        Animation { measured: Some(stops), ..self }
    }

    /// Checks that every file of a sequence is there which these frames read.
    ///
    /// # Errors
    /// [`Error::Input`] with the first files that are missing.
    pub fn check_files(&self, frames: &[i32]) -> Result<()> {
        let folder = self.folder.as_deref();
        let shown = volumes::shown(&self.values);
        for sequence in shown.iter().filter_map(|name| Sequence::of(&self.values, name, folder)) {
            let first = self.values.int(&sequence.frame);
            let track = self.tracks.iter().find(|(key, _)| *key == sequence.frame);
            let numbers = frames.iter().map(|&frame| {
                let number = self.period.map_or(frame, |n| frame.rem_euclid(n as i32));
                match track {
                    Some((_, track)) => track.at(number.into())[0].round() as i64,
                    None => first + i64::from(number),
                }
            });
            let numbers: BTreeSet<i64> = numbers.collect();
            sequence.check(&numbers.into_iter().collect::<Vec<_>>(), folder)?;
        }
        Ok(())
    }

    /// Returns the scene of a frame. It contains nothing of the animation but the speed of the flow while the
    /// shutter is open: printed as a scene file, it gives the same picture.
    ///
    /// # Errors
    /// The errors of [`Scene::from_values`]; from frame 1 on the message names the frame.
    pub fn at(&self, frame: i32) -> Result<Scene> {
        let mut values = self.values.clone();
        values.clear_under("animate");
        let place = |key: &str| Place(format!("frame {frame}, animation of {key}"));
        let number = self.period.map_or(frame, |n| frame.rem_euclid(n as i32));
        let time = f64::from(number);
        let moves_flow = self.tracks.iter().any(|(key, _)| key == "volume.flow");
        if self.flow.0 != 0.0 && number != 0 && !moves_flow {
            // Whole lengths do not change the picture, but would cost long animations precision.
            let moved = (self.flow.0 * time / self.flow.1) % 1.0;
            let flow = f64::from(values.float("volume.flow")) + moved;
            values.set("volume.flow", &Raw::Float(flow), &place("volume.flow"))?;
        }
        for name in volumes::names(&values).iter().filter(|_| number != 0) {
            let Some(sequence) = Sequence::of(&values, name, self.folder.as_deref()) else { continue };
            let now = values.int(&sequence.frame) + i64::from(number);
            values.set(&sequence.frame, &Raw::Int(now), &place(&sequence.frame))?;
        }
        for (key, track) in &self.tracks {
            values.set(key, &raw(key, &track.at(time)), &place(key))?;
        }
        if let Some(path) = &self.path {
            let (eye, target) = path.at(time);
            values.set("camera.eye", &list(&eye.to_array()), &place("camera.eye"))?;
            if let Some(target) = target {
                values.set("camera.target", &list(&target), &place("camera.target"))?;
            }
        }
        if self.turn != 0 && i64::from(number) % self.turn != 0 {
            let [eye, target, up] =
                ["eye", "target", "up"].map(|what| values.point(&format!("camera.{what}")));
            let share = (i64::from(number) % self.turn) as f64 / self.turn as f64;
            let axis = up.try_normalize().unwrap_or(DVec3::Y);
            let turned =
                target + DQuat::from_axis_angle(axis, share * std::f64::consts::TAU) * (eye - target);
            values.set("camera.eye", &list(&turned.to_array()), &place("camera.eye"))?;
        }
        if let Some(stops) = self.measured {
            expose(&mut values, stops);
        }
        if values.float("image.grain") > 0.0 && number != 0 {
            let moves = |(key, _): &(String, Keyframes)| key == "image.grain_seed";
            let seed = values.int("image.grain_seed") + i64::from(number);
            if !self.tracks.iter().any(moves) {
                let seed = Raw::Int(seed.rem_euclid(1 << 31));
                values.set("image.grain_seed", &seed, &place("image.grain_seed"))?;
            }
        }
        let shutter = f64::from(values.float("camera.shutter"));
        if shutter > 0.0 {
            let half = 0.5 * shutter * self.fps;
            let speed = match self.tracks.iter().find(|(key, _)| key == "volume.flow") {
                Some((_, track)) => track.change(time - half, time + half) / shutter,
                None => speed(&self.values),
            };
            let speed = Raw::Float(speed.clamp(-1000.0, 1000.0));
            values.set("animate.speed", &speed, &place("animate.speed"))?;
        }
        let scene = || {
            let folder = self.folder.as_deref();
            if !values.text("camera.from").is_empty() {
                let meshes = meshes::read(&values, folder, &self.limits)?;
                if let Some(seen) = meshes::with_camera(&values, &meshes, time / self.fps)? {
                    values = seen;
                }
            }
            Scene::from_values(&self.name, values, folder, &self.limits)
        };
        scene()
            .map(|scene| scene.recorded(self.record.clone()))
            .map_err(|e| if frame == 0 { e } else { at_frame(e, frame) })
    }
}

/// Returns a number. It is taken in float64, because the float32 of 23.976 is another number.
fn number(values: &Values, key: &str) -> f64 {
    match values.get(key) {
        Value::Float(x) => x,
        _ => f64::from(values.float(key)),
    }
}

/// Returns the speed of the flow as a fraction: lengths of the volume over frames, whole lengths in a loop.
fn flow(speed: f64, fps: f64, period: Option<u32>) -> (f64, f64) {
    let Some(n) = period.map(f64::from) else { return (speed, fps) };
    let lengths = speed * n / fps;
    let whole = if speed == 0.0 { 0.0 } else { lengths.abs().round().max(1.0).copysign(lengths) };
    (whole, n)
}

/// Returns the speed at which the volume `water` moves down the flow, lengths per second.
pub(super) fn speed(values: &Values) -> f64 {
    let fps = number(values, "animate.fps");
    let period = Some(values.count("animate.loop")).filter(|&n| n > 0);
    match flow(number(values, "animate.speed"), fps, period) {
        // Without a loop it is what was written.
        (speed, _) if period.is_none() => speed,
        (lengths, frames) => lengths / frames * fps,
    }
}

/// Adds the number of the frame to an error.
fn at_frame(error: Error, frame: i32) -> Error {
    match error {
        Error::Input { what, fix } => Error::Input { what: format!("frame {frame}: {what}"), fix },
        other => other,
    }
}

/// Reads a track: the key that it moves, and its keyframes.
fn track(values: &Values, section: &str, period: Option<u32>) -> Result<(String, Keyframes)> {
    let bad = |what: String, fix: String| Err(Error::input(format!("{section}: {what}"), fix));
    let key = values.text(&format!("{section}.key"));
    if key.is_empty() {
        return bad(
            "the track has no key".into(),
            "name the parameter it moves, such as key = \"curves.h\"".into(),
        );
    }
    let (frames, series) =
        (values.frames(&format!("{section}.frames")), values.series(&format!("{section}.values")));
    let place = Place(format!("{section}.key"));
    let Some(param) = Param::find(&key) else {
        // The key is unknown, so `set` fails with an error that names the nearest key.
        return Err(match values.clone().set(&key, &Raw::Int(0), &place) {
            Err(e) => e,
            Ok(()) => Error::input(format!("{section}: {key} cannot move"), "name another parameter"),
        });
    };
    if key.starts_with("animate.") || key == "image.width" || key == "image.height" {
        return bad(
            format!("{key} cannot move"),
            "all frames share the picture's size and the animation's own parameters".into(),
        );
    }
    if matches!(param.kind, Kind::Text(_) | Kind::Choice(_) | Kind::Switch(_)) || param.is_list() {
        return bad(
            format!("{key} is no number"),
            "only numbers, colours, points and corners can move".into(),
        );
    }
    if let Err((what, fix)) = check_names(values, &key) {
        return bad(what, fix);
    }
    if frames.is_empty() || frames.len() != series.len() {
        let (f, v) = (frames.len(), series.len());
        return bad(format!("{f} frames and {v} values"), "give each keyframe a frame and a value".into());
    }
    let mut scratch = values.clone();
    for (frame, value) in frames.iter().zip(&series) {
        scratch.set(&key, &raw(&key, value), &Place(format!("{section}.values at frame {frame}")))?;
    }
    let interpolation = values.choice(&format!("{section}.interpolation"), Interpolation::from_word);
    // A whole length of the volume further, the flow shows the same picture.
    let closes = |first: &[f64], last: &[f64]| match key.as_str() {
        key if split_volume_key(key).is_some_and(|(_, own)| own == "volume.flow") => {
            (last[0] - first[0]).fract() == 0.0
        }
        _ => first == last,
    };
    match Keyframes::new(&frames, series, interpolation, period, closes) {
        Ok(track) => Ok((key, track)),
        Err(why) => {
            bad(format!("the keyframes of {key} {why}"), "see animate.loop in docs/parameters.md".into())
        }
    }
}

/// Reads the camera's path, if the animation has one.
fn path(values: &Values, frames: u32, period: Option<u32>) -> Result<Option<CameraPath>> {
    let [eyes, targets] = ["eyes", "targets"].map(|what| values.series(&format!("animate.path.{what}")));
    let at = values.frames("animate.path.frames");
    if eyes.is_empty() {
        return match targets.is_empty() && at.is_empty() {
            true => Ok(None),
            false => Err(Error::input(
                "animate.path has no eyes",
                "give the points that the camera passes through",
            )),
        };
    }
    let mut scratch = values.clone();
    for (key, points) in [("camera.eye", &eyes), ("camera.target", &targets)] {
        for point in points {
            scratch.set(key, &raw(key, point), &Place("animate.path".into()))?;
        }
    }
    let counts = [
        eyes.len(),
        if targets.is_empty() { eyes.len() } else { targets.len() },
        if at.is_empty() { eyes.len() } else { at.len() },
    ];
    if eyes.len() < 2 || counts.iter().any(|&n| n != eyes.len()) {
        return Err(Error::input(
            format!(
                "animate.path has {} eyes, {} targets and {} frames",
                eyes.len(),
                targets.len(),
                at.len()
            ),
            "give at least two eyes, and as many targets and frames or none",
        ));
    }
    CameraPath::new(&at, eyes, targets, frames, period).map(Some).map_err(|why| {
        Error::input(format!("animate.path.frames {why}"), "see animate.loop in docs/parameters.md")
    })
}

/// Converts components to a value of the parameter's kind.
fn raw(key: &str, components: &[f64]) -> Raw {
    let whole = Param::find(key).is_some_and(|p| matches!(p.kind, Kind::Int(..)));
    match components {
        [x] if whole => Raw::Int(x.round() as i64),
        [x] => Raw::Float(*x),
        [_, _, _] => list(components),
        corners => Raw::List(corners.chunks_exact(3).map(list).collect()),
    }
}

fn list(components: &[f64]) -> Raw {
    Raw::List(components.iter().map(|&x| Raw::Float(x)).collect())
}
