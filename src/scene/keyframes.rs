//! Interpolation between keyframes (lines, steps, and curves that never overshoot), and the camera's path.

use glam::DVec3;

use crate::util::words::words;

/// Number of chords that measure the length of one segment of a path. The curve between two points bends by
/// less than half a turn, so the chords are short by less than a ten thousandth.
const PIECES: usize = 64;

/// Course of a value between two keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// A straight line.
    Linear,
    /// A monotone cubic (Fritsch and Butland 1984): no value lies outside those of its two keyframes.
    Smooth,
    /// The value of the keyframe before.
    Hold,
}

words! { Interpolation { Linear => "linear", Smooth => "smooth", Hold => "hold" } }

/// Values at frames, with the interpolation between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframes {
    /// Frame and components of each keyframe, sorted by frame.
    keys: Vec<(f64, Vec<f64>)>,
    /// Slope of each component at each keyframe, per frame.
    slopes: Vec<Vec<f64>>,
    interpolation: Interpolation,
    period: Option<f64>,
}

impl Keyframes {
    /// Makes keyframes at increasing frames.
    ///
    /// With a `period` the track is a loop: after its last keyframe it continues to its first. If the last
    /// keyframe lies exactly one period after the first, `closes` tells whether their values agree.
    ///
    /// # Errors
    /// The fault of the frames, as the end of a sentence.
    pub fn new(
        frames: &[i64],
        values: Vec<Vec<f64>>,
        interpolation: Interpolation,
        period: Option<u32>,
        closes: impl Fn(&[f64], &[f64]) -> bool,
    ) -> Result<Self, String> {
        let mut keys: Vec<(f64, Vec<f64>)> = frames.iter().map(|&f| f as f64).zip(values).collect();
        if let Some(n) = period.map(f64::from) {
            check_loop(frames, n)?;
            let (first, last) = (keys[0].clone(), &keys[keys.len() - 1]);
            if last.0 == first.0 + n {
                if !closes(&first.1, &last.1) {
                    return Err(format!(
                        "jump where the loop of {n} frames closes: first and last value differ"
                    ));
                }
            } else {
                keys.push((first.0 + n, first.1));
            }
        }
        Ok(Keyframes::of_keys(keys, interpolation, period.map(f64::from)))
    }

    fn of_keys(keys: Vec<(f64, Vec<f64>)>, interpolation: Interpolation, period: Option<f64>) -> Self {
        let last = keys.len() - 1;
        let secant = |i: usize, c: usize| (keys[i + 1].1[c] - keys[i].1[c]) / (keys[i + 1].0 - keys[i].0);
        let width = |i: usize| keys[i + 1].0 - keys[i].0;
        let slope = |i: usize, c: usize| {
            // The intervals before and after the keyframe. In a loop the ends have both, too.
            let (before, after) = match (i, period) {
                _ if last == 0 => return 0.0,
                (0, Some(_)) => (last - 1, 0),
                (i, Some(_)) if i == last => (last - 1, 0),
                // An open curve starts and ends at rest.
                (0, None) => return 0.0,
                (i, None) if i == last => return 0.0,
                (i, _) => (i - 1, i),
            };
            let (d0, d1, h0, h1) = (secant(before, c), secant(after, c), width(before), width(after));
            if d0 * d1 <= 0.0 {
                return 0.0;
            }
            3.0 * (h0 + h1) / ((2.0 * h1 + h0) / d0 + (h1 + 2.0 * h0) / d1)
        };
        let components = keys[0].1.len();
        let slopes = (0..=last).map(|i| (0..components).map(|c| slope(i, c)).collect()).collect();
        Keyframes { keys, slopes, interpolation, period }
    }

    /// Returns by how much the first component changes from one frame to another. Where a loop closes from
    /// one value to another that shows the same picture, the step between them is no change.
    pub fn change(&self, from: f64, to: f64) -> f64 {
        let change = self.at(to)[0] - self.at(from)[0];
        let ((first, start), (last, end)) = (&self.keys[0], &self.keys[self.keys.len() - 1]);
        match self.period {
            Some(n) if last - first == n => {
                let turns = ((to - first) / n).floor() - ((from - first) / n).floor();
                change + turns * (end[0] - start[0])
            }
            _ => change,
        }
    }

    /// Returns the components at a frame.
    pub fn at(&self, frame: f64) -> Vec<f64> {
        let first = self.keys[0].0;
        let frame = match self.period {
            Some(n) => first + (frame - first).rem_euclid(n),
            None => frame,
        };
        let next = self.keys.partition_point(|(f, _)| *f <= frame);
        if next == 0 {
            return self.keys[0].1.clone();
        }
        let (f0, a) = &self.keys[next - 1];
        let Some((f1, b)) = self.keys.get(next) else { return a.clone() };
        let h = f1 - f0;
        let s = (frame - f0) / h;
        let (m0, m1) = (&self.slopes[next - 1], &self.slopes[next]);
        let component = |c: usize| match self.interpolation {
            Interpolation::Hold => a[c],
            Interpolation::Linear => a[c] + (b[c] - a[c]) * s,
            Interpolation::Smooth => {
                let (s2, s3) = (s * s, s * s * s);
                let hermite = (2.0 * s3 - 3.0 * s2 + 1.0) * a[c]
                    + (s3 - 2.0 * s2 + s) * h * m0[c]
                    + (3.0 * s2 - 2.0 * s3) * b[c]
                    + (s3 - s2) * h * m1[c];
                // Rounding must not push the value out of the parameter's range.
                hermite.clamp(a[c].min(b[c]), a[c].max(b[c]))
            }
        };
        (0..a.len()).map(component).collect()
    }
}

/// Checks that the keyframes of a loop lie inside it.
fn check_loop(frames: &[i64], period: f64) -> Result<(), String> {
    match frames.iter().find(|&&f| f < 0 || f as f64 > period) {
        Some(f) if *f < 0 => Err(format!("have frame {f}, which is before the loop, whose first frame is 0")),
        Some(f) => Err(format!("have frame {f}, which is past the loop of {period} frames")),
        None => Ok(()),
    }
}

/// A smooth curve through positions of the camera, along which it moves with smoothly changing speed. The
/// curve is centripetal Catmull-Rom, which has neither loops nor cusps between its points (Yuksel, Schaefer
/// and Keyser 2011).
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// Points of the curve: distance along it in metres, and position.
    curve: Vec<(f64, DVec3)>,
    /// Distance along the curve at each frame, metres.
    distances: Keyframes,
    targets: Option<Keyframes>,
}

impl CameraPath {
    /// Makes a path through `eyes`, at least two, at the frames `at`. Without `at` the points are spread
    /// evenly over the animation's `frames` or over its loop. In a loop the path is closed.
    ///
    /// # Errors
    /// The fault of the frames, as the end of a sentence.
    pub fn new(
        at: &[i64],
        eyes: Vec<Vec<f64>>,
        targets: Vec<Vec<f64>>,
        frames: u32,
        period: Option<u32>,
    ) -> Result<Self, String> {
        let mut points: Vec<DVec3> = eyes.iter().map(|p| DVec3::from_slice(p)).collect();
        let spread =
            |count: usize, length: f64| (0..count).map(|i| i as f64 * length / (count - 1) as f64).collect();
        let mut times: Vec<f64> = match (at, period) {
            ([], None) => spread(points.len(), f64::from(frames - 1).max(1.0)),
            ([], Some(n)) => {
                let mut times: Vec<f64> = spread(points.len() + 1, f64::from(n));
                times.pop();
                times
            }
            (given, _) => given.iter().map(|&f| f as f64).collect(),
        };
        let mut looks = targets;
        if let Some(n) = period.map(f64::from) {
            check_loop(at, n)?;
            let last = points.len() - 1;
            if times[last] == times[0] + n {
                if points[last] != points[0] || looks.first() != looks.last() {
                    return Err("jump where the loop closes: first and last point differ".into());
                }
            } else {
                points.push(points[0]);
                times.push(times[0] + n);
                looks.extend(looks.first().cloned());
            }
        }
        let (curve, lengths) = trace(&points, period.is_some());
        let keys = |values: Vec<Vec<f64>>| times.iter().copied().zip(values).collect();
        let period = period.map(f64::from);
        let distances = Keyframes::of_keys(
            keys(lengths.into_iter().map(|l| vec![l]).collect()),
            Interpolation::Smooth,
            period,
        );
        let targets =
            (!looks.is_empty()).then(|| Keyframes::of_keys(keys(looks), Interpolation::Smooth, period));
        Ok(CameraPath { curve, distances, targets })
    }

    /// Whether the path moves the target, too.
    pub fn has_targets(&self) -> bool {
        self.targets.is_some()
    }

    /// Returns the camera's position at a frame, and its target if the path moves it.
    pub fn at(&self, frame: f64) -> (DVec3, Option<Vec<f64>>) {
        let metres = self.distances.at(frame)[0];
        let next = self.curve.partition_point(|(s, _)| *s <= metres).clamp(1, self.curve.len() - 1);
        let ((s0, a), (s1, b)) = (self.curve[next - 1], self.curve[next]);
        let share = if s1 > s0 { ((metres - s0) / (s1 - s0)).clamp(0.0, 1.0) } else { 0.0 };
        (a.lerp(b, share), self.targets.as_ref().map(|t| t.at(frame)))
    }
}

/// Returns the curve through `points` as short chords with the distance along them, and the distance at each
/// point; metres.
fn trace(points: &[DVec3], closed: bool) -> (Vec<(f64, DVec3)>, Vec<f64>) {
    let last = points.len() - 1;
    // An open path continues straight beyond its ends.
    let before = if closed { points[last - 1] } else { 2.0 * points[0] - points[1] };
    let after = if closed { points[1] } else { 2.0 * points[last] - points[last - 1] };
    let point = |i: isize| match usize::try_from(i) {
        Err(_) => before,
        Ok(i) if i > last => after,
        Ok(i) => points[i],
    };
    let mut curve = vec![(0.0, points[0])];
    let mut lengths = vec![0.0];
    let mut metres = 0.0;
    for i in 0..last as isize {
        let p = [point(i - 1), point(i), point(i + 1), point(i + 2)];
        for piece in 1..=PIECES {
            let here = catmull_rom(p, piece as f64 / PIECES as f64);
            metres += here.distance(curve[curve.len() - 1].1);
            curve.push((metres, here));
        }
        lengths.push(metres);
    }
    (curve, lengths)
}

/// Evaluates a centripetal Catmull-Rom curve between p₁ (s = 0) and p₂ (s = 1) by Barry and Goldman's
/// pyramid.
fn catmull_rom(p: [DVec3; 4], s: f64) -> DVec3 {
    if s == 1.0 {
        return p[2];
    }
    // Equal points would have no knot interval between them, so it is at least 1e-9.
    let knot = |a: DVec3, b: DVec3| a.distance(b).sqrt().max(1e-9);
    let t1 = knot(p[0], p[1]);
    let t2 = t1 + knot(p[1], p[2]);
    let t3 = t2 + knot(p[2], p[3]);
    let t = t1 + (t2 - t1) * s;
    let mix = |a: DVec3, b: DVec3, ta: f64, tb: f64| (a * (tb - t) + b * (t - ta)) / (tb - ta);
    let a = [mix(p[0], p[1], 0.0, t1), mix(p[1], p[2], t1, t2), mix(p[2], p[3], t2, t3)];
    let b = [mix(a[0], a[1], 0.0, t2), mix(a[1], a[2], t1, t3)];
    mix(b[0], b[1], t1, t2)
}
