//! Statistics of the active samples below a node, as NanoVDB stores them.

/// Box, extremes, mean and spread of active samples. Of vectors, the extremes are those with the least and
/// the greatest length, and mean and spread are those of the squared length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stats {
    pub low: [i32; 3],
    pub high: [i32; 3],
    pub min: [f32; 3],
    pub max: [f32; 3],
    /// Number of samples.
    pub count: u64,
    /// Numbers by which `min` and `max` were chosen.
    least: f32,
    greatest: f32,
    mean: f64,
    /// Sum of the squared distances from the mean.
    squares: f64,
}

impl Stats {
    /// Statistics of no samples.
    pub fn none() -> Stats {
        Stats {
            low: [i32::MAX; 3],
            high: [i32::MIN; 3],
            min: [0.0; 3],
            max: [0.0; 3],
            count: 0,
            least: f32::INFINITY,
            greatest: f32::NEG_INFINITY,
            mean: 0.0,
            squares: 0.0,
        }
    }

    /// Statistics of a cube of samples with one value of `channels` numbers.
    pub fn cube(origin: [i32; 3], side: u32, value: [f32; 3], channels: usize) -> Stats {
        let number = match channels {
            1 => value[0],
            _ => value[0] * value[0] + value[1] * value[1] + value[2] * value[2],
        };
        Stats {
            low: origin,
            high: origin.map(|x| x + (side - 1) as i32),
            min: value,
            max: value,
            count: u64::from(side).pow(3),
            least: number,
            greatest: number,
            mean: number.into(),
            squares: 0.0,
        }
    }

    /// Adds other samples (Chan, Golub and LeVeque 1979).
    pub fn add(&mut self, other: &Stats) {
        if other.count == 0 {
            return;
        }
        for a in 0..3 {
            self.low[a] = self.low[a].min(other.low[a]);
            self.high[a] = self.high[a].max(other.high[a]);
        }
        if other.least < self.least {
            (self.least, self.min) = (other.least, other.min);
        }
        if other.greatest > self.greatest {
            (self.greatest, self.max) = (other.greatest, other.max);
        }
        let [own, more] = [self.count, other.count].map(|n| n as f64);
        let all = own + more;
        let apart = other.mean - self.mean;
        self.mean += apart * more / all;
        self.squares += other.squares + apart * apart * own * more / all;
        self.count += other.count;
    }

    /// Mean, and standard deviation of the whole population.
    pub fn mean_and_deviation(&self) -> [f32; 2] {
        [self.mean as f32, (self.squares / self.count.max(1) as f64).sqrt() as f32]
    }
}
