//! `taki volume info` of files of simulations.

use std::path::Path;

use serde_json::{Value, json};

use super::terminal::{Terminal, say};
use crate::grid::{Bounds, Grid, Statistics, Summary, list, read};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// A grid with what was read of it.
struct Entry {
    summary: Summary,
    /// Numbers of a sample, active samples, their bounds and their statistics.
    read: Option<(usize, u64, Option<Bounds>, Option<Statistics>)>,
    /// Changes made on reading.
    note: Option<String>,
}

/// Prints the grids of a file with statistics of those that can be read.
///
/// # Errors
/// After all is printed, the error of the first grid that is broken. One of a kind that is not read is no
/// error.
pub fn info(file: &Path, as_json: bool, memory: u64, terminal: &Terminal) -> Result<()> {
    let summaries = list(file, memory)?;
    let total = summaries.len() as u64;
    let mut entries = Vec::new();
    let mut failed = None;
    for (done, mut summary) in summaries.into_iter().enumerate() {
        terminal.progress("reading", done as u64, total)?;
        let (mut found, mut note) = (None, None);
        if summary.refusal.is_none() {
            match read(file, &summary.name, memory) {
                Ok(grid) => {
                    note = grid.note();
                    found = Some(numbers(&grid));
                }
                Err(error) => {
                    summary.refusal = Some(error.to_string());
                    failed.get_or_insert(error);
                }
            }
        }
        entries.push(Entry { summary, read: found, note });
    }
    terminal.close();
    match as_json {
        true => say(&json!({"grids": entries.iter().map(Entry::json).collect::<Vec<_>>()}).to_string())?,
        false if entries.is_empty() => say("no grids")?,
        false => entries.iter().try_for_each(|entry| say(&entry.words()))?,
    }
    failed.map_or(Ok(()), Err)
}

fn numbers(grid: &Grid) -> (usize, u64, Option<Bounds>, Option<Statistics>) {
    (grid.channels(), grid.active_count(), grid.bounds(), grid.statistics())
}

/// Components of a value: one number, or several in brackets.
fn components<T: std::fmt::Display>(values: &[T]) -> String {
    match values {
        [one] => one.to_string(),
        all => format!("({})", all.iter().map(T::to_string).collect::<Vec<_>>().join(", ")),
    }
}

impl Entry {
    fn words(&self) -> String {
        let summary = &self.summary;
        let class = summary.class.words();
        let mut lines = vec![format!(
            "{}: {}, class {class}, compression {}",
            summary.name, summary.kind, summary.compression
        )];
        let (active, bounds) = match self.read {
            Some((_, active, bounds, _)) => (Some(active), bounds),
            None => (summary.active, summary.bounds),
        };
        if let Some(active) = active {
            let place = bounds.map_or(String::new(), |bounds| {
                let [x, y, z] = bounds.size();
                format!(" in {x} × {y} × {z} from {:?} to {:?}", bounds.min, bounds.max)
            });
            lines.push(format!("  active     {active} samples{place}"));
        }
        if let Some(to_world) = summary.to_world {
            let axes = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, to_world.matrix3.z_axis];
            let [x, y, z] = axes.map(|axis| axis.length() as f32);
            let turned = if is_straight(&axes) { "" } else { ", turned" };
            let zero = components(&to_world.translation.to_array());
            lines.push(format!("  voxel      {x} × {y} × {z}{turned}; index (0, 0, 0) lies at {zero}"));
        }
        if let Some((channels, _, _, Some(found))) = &self.read {
            let mean = found.mean.map(|x| x as f32);
            let [min, max, mean] =
                [&found.min, &found.max, &mean].map(|value| components(&value[..*channels]));
            lines.push(format!("  values     {min} to {max}, mean {mean}"));
        }
        if let Some(note) = &self.note {
            lines.push(format!("  note       {note}"));
        }
        if let Some(why) = &summary.refusal {
            lines.push(format!("  not read   {why}"));
        }
        lines.join("\n")
    }

    fn json(&self) -> Value {
        let summary = &self.summary;
        let mut object = json!({
            "name": summary.name,
            "type": summary.kind,
            "class": summary.class.words(),
            "compression": summary.compression,
            "active": summary.active,
            "bounds": summary.bounds.map(box_of),
            // Three rows of four numbers.
            "to_world": summary.to_world.map(|t| {
                let [x, y, z] = t.matrix3.to_cols_array_2d();
                let row = |a: usize| [x[a], y[a], z[a], t.translation.to_array()[a]];
                [row(0), row(1), row(2)]
            }),
            "note": self.note,
            "not_read": summary.refusal,
        });
        if let Some((channels, active, bounds, found)) = &self.read {
            object["active"] = json!(active);
            object["bounds"] = json!(bounds.map(box_of));
            object["channels"] = json!(channels);
            if let Some(found) = found {
                object["min"] = json!(found.min[..*channels]);
                object["max"] = json!(found.max[..*channels]);
                object["mean"] = json!(found.mean[..*channels]);
            }
        }
        object
    }
}

fn box_of(bounds: Bounds) -> Value {
    json!({"min": bounds.min, "max": bounds.max})
}

/// Whether the axes of the index space are those of the world.
fn is_straight(axes: &[glam::DVec3; 3]) -> bool {
    axes.iter().enumerate().all(|(a, axis)| (0..3).all(|b| a == b || axis[b] == 0.0))
}
