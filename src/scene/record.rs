//! Scenes that were read from pictures. A picture holds its scene, but neither a volume file nor an
//! environment map: it tells their checksums alone. So a picture that is rendered again is the same, or is
//! refused.

use super::build::{self, EnvironmentKind};
use super::{Scene, Values};
use crate::light::environment::Source;
use crate::util::error::{Error, Result};
use crate::volume::{VolumeTexture, WaterSpec};

/// Start of the comment that tells the checksum of a picture's volume, in hex.
pub const VOLUME_COMMENT: &str = "# volume texture: crc32 ";
/// Start of the comment that tells the checksum of a picture's environment map, in hex.
pub const MAP_COMMENT: &str = "# environment map: crc32 ";

/// Record in a picture of the files that its scene had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Checksum of the volume.
    volume: Option<u32>,
    /// Checksum of the environment map's file.
    map: Option<u32>,
    /// Recipe of a volume without a file.
    water: WaterSpec,
}

impl Record {
    /// Reads the comments at the start of a picture's scene, whose values are `values`. `None` where there
    /// are none, as in a scene that somebody wrote. The values of a picture, which holds all parameters, are
    /// marked as such.
    pub fn of(text: &str, values: &mut Values) -> Option<Record> {
        let comments: Vec<&str> = text.lines().take_while(|line| line.starts_with('#')).collect();
        let checksum = |start: &str| {
            comments.iter().find_map(|line| u32::from_str_radix(line.strip_prefix(start)?.trim(), 16).ok())
        };
        let (volume, map) = (checksum(VOLUME_COMMENT), checksum(MAP_COMMENT));
        (volume.is_some() || map.is_some()).then(|| {
            values.come_from_base();
            Record { volume, map, water: build::water(values) }
        })
    }

    /// Checks that values which name no environment map need none.
    ///
    /// # Errors
    /// [`Error::Input`] where the picture was lit by a map.
    pub fn check_map(&self, values: &Values) -> Result<()> {
        let asks = values.choice("environment.kind", EnvironmentKind::from_word) == EnvironmentKind::File;
        match self.map {
            Some(map) if asks && values.text("environment.file").is_empty() => Err(Error::input(
                format!(
                    "the picture was lit by an environment map (crc32 {map:08x}), which it does not hold"
                ),
                "give the map again with --set environment.file=FILE",
            )),
            _ => Ok(()),
        }
    }
}

impl Scene {
    /// Returns the scene with what the picture tells that it was read from.
    pub(crate) fn recorded(self, record: Option<Record>) -> Scene {
        Scene { record, ..self }
    }

    /// Returns what the picture tells that the scene was read from.
    pub fn record(&self) -> Option<Record> {
        self.record
    }

    /// Checks that a built volume is that of the picture which the scene was read from. A scene with another
    /// recipe has another volume.
    pub(super) fn check_built(&self, volume: &VolumeTexture) -> Result<()> {
        let record = self.record.filter(|record| self.volume_file.is_none() && record.water == self.water);
        let Some(then) = record.and_then(|record| record.volume) else { return Ok(()) };
        let now = volume.checksum();
        if then == now {
            return Ok(());
        }
        Err(Error::input(
            format!("the picture shows another volume (crc32 {then:08x}) than its scene builds ({now:08x})"),
            "give the volume's file again with --set volume.file=FILE; if there was none, another version of \
             taki built it, and `taki scene PICTURE | taki render -` renders what this one builds",
        ))
    }

    /// Returns warnings about files that differ from those of the picture which the scene was read from.
    pub(super) fn other_files(&self, volume: &VolumeTexture) -> Vec<String> {
        let Some(record) = self.record else { return Vec::new() };
        let map = self.environment.as_ref().filter(|e| matches!(e.source, Source::File(_)));
        let files = [
            ("volume.file", record.volume, self.volume_file.is_some().then(|| volume.checksum())),
            ("environment.file", record.map, map.map(|e| e.map.checksum())),
        ];
        let differs = |(key, then, now): (&str, Option<u32>, Option<u32>)| {
            let (then, now) = then.zip(now).filter(|(then, now)| then != now)?;
            Some(format!("{key} is not that of the picture: its crc32 was {then:08x} and is {now:08x}"))
        };
        files.into_iter().filter_map(differs).collect()
    }
}
