//! Scenes that were read from pictures. A picture holds its scene, but neither a volume file nor an
//! environment map: it tells their checksums alone. So a picture that is rendered again is the same, or is
//! refused.

use super::build::{self, EnvironmentKind};
use super::param::key_of_volume;
use super::{Recipe, Scene, Values, volumes};
use crate::light::environment::Source;
use crate::util::error::{Error, Result};
use crate::volume::{VolumeTexture, WaterSpec};

/// Start of the comment that tells the checksum of a picture's volume, in hex.
pub const VOLUME_COMMENT: &str = "# volume texture: crc32 ";
/// Start of the comment that tells the checksum of a picture's environment map, in hex.
pub const MAP_COMMENT: &str = "# environment map: crc32 ";

/// Record in a picture of the files that its scene had.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Checksums of the volumes, in the order of their numbers.
    volumes: Vec<u32>,
    /// Checksum of the environment map's file.
    map: Option<u32>,
    /// Recipes of the volumes, used where they have no files.
    waters: Vec<WaterSpec>,
}

impl Record {
    /// Reads the comments at the start of a picture's scene, whose values are `values`. `None` where there
    /// are none, as in a scene that somebody wrote. The values of a picture, which holds all parameters, are
    /// marked as such.
    pub fn of(text: &str, values: &mut Values) -> Option<Record> {
        let comments: Vec<&str> = text.lines().take_while(|line| line.starts_with('#')).collect();
        let checksums = |start: &str| {
            let read = |line: &&str| {
                let words = line.strip_prefix(start)?.split_whitespace();
                words.map(|word| u32::from_str_radix(word, 16).ok()).collect::<Option<Vec<u32>>>()
            };
            comments.iter().find_map(read).unwrap_or_default()
        };
        let (volumes, map) = (checksums(VOLUME_COMMENT), checksums(MAP_COMMENT).first().copied());
        (!volumes.is_empty() || map.is_some()).then(|| {
            values.come_from_base();
            let waters = volumes::shown(values).iter().map(|name| build::water(values, name)).collect();
            Record { volumes, map, waters }
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
        self.record.clone()
    }

    /// Checks that volume `number`, if it was built, is that of the picture which the scene was read from. A
    /// scene with other recipes has other volumes.
    pub(super) fn check_built(&self, number: usize, volume: &VolumeTexture) -> Result<()> {
        let Recipe { name, water, file, .. } = &self.recipes[number];
        let is_same = |record: &&Record| {
            file.is_none()
                && record.waters.len() == self.recipes.len()
                && record.waters.get(number) == Some(water)
        };
        let record = self.record.as_ref().filter(is_same);
        let Some(&then) = record.and_then(|record| record.volumes.get(number)) else { return Ok(()) };
        let now = volume.checksum();
        if then == now {
            return Ok(());
        }
        Err(Error::input(
            format!("the picture shows another volume (crc32 {then:08x}) than its scene builds ({now:08x})"),
            format!(
                "give the volume's file again with --set {}=FILE; if there was none, another version of \
                 taki built it, and `taki scene PICTURE | taki render -` renders what this one builds",
                key_of_volume(name, "volume.file")
            ),
        ))
    }

    /// Returns warnings about files that differ from those of the picture which the scene was read from.
    pub(super) fn other_files(&self, volumes: &[VolumeTexture]) -> Vec<String> {
        let Some(record) = &self.record else { return Vec::new() };
        let map = self.environment.as_ref().filter(|e| matches!(e.source, Source::File(_)));
        let of_volumes = self.recipes.iter().zip(volumes).enumerate().map(|(i, (recipe, volume))| {
            let now = recipe.file.is_some().then(|| volume.checksum());
            (recipe.file_key(), record.volumes.get(i).copied(), now)
        });
        let map = ("environment.file".to_owned(), record.map, map.map(|e| e.map.checksum()));
        let differs = |(key, then, now): (String, Option<u32>, Option<u32>)| {
            let (then, now) = then.zip(now).filter(|(then, now)| then != now)?;
            Some(format!("{key} is not that of the picture: its crc32 was {then:08x} and is {now:08x}"))
        };
        of_volumes.chain([map]).filter_map(differs).collect()
    }
}
