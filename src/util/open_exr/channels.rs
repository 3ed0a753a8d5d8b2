//! Which channels of an EXR file are the picture.

use std::collections::HashMap;

use exr::meta::header::Header;
use exr::prelude::Vec2;

/// Names that are understood, for messages.
const NAMES: &str = "name the channels R, G, B, or Y, or Y, RY, BY, alone or behind the name of one pass, \
                         such as ViewLayer.Combined.R";
/// Names of passes and parts that are the whole picture.
const WHOLE: [&str; 6] = ["combined", "beauty", "rgba", "rgb", "image", "composite"];
/// Maximum number of channels in a message.
const LISTED: usize = 16;

/// Meaning of three channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Red, green and blue.
    Rgb,
    /// (R − Y)/Y, Y and (B − Y)/Y.
    Chroma,
    /// The same channel three times.
    Grey,
}

/// How clear it is that channels are the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Channels without a prefix in a part without a name.
    Plain,
    /// A prefix or a part's name that says so.
    Named,
    /// Channels without a prefix in a part of another name.
    InPart,
    /// Channels with another prefix.
    Pass,
}

/// Channels that may be the picture.
#[derive(Debug)]
pub struct Picture {
    /// Index of the part.
    pub part: usize,
    pub kind: Kind,
    /// Indices of three channels.
    pub channels: [usize; 3],
    /// Index of the alpha channel, if there is one.
    pub alpha: Option<usize>,
    rank: Rank,
}

/// Returns the picture of a file. The error says why there is none, and the way out.
pub fn picture_of(headers: &[Header]) -> Result<Picture, (String, &'static str)> {
    let mut found: Vec<Picture> = headers.iter().enumerate().flat_map(|(i, h)| pictures(i, h)).collect();
    // Clear ones come first, and colours before grey.
    found.sort_by_key(|p| (p.rank == Rank::Pass, p.kind == Kind::Grey, p.rank, p.part));
    let Some(best) = found.first() else {
        let deep = headers.iter().any(|h| h.deep);
        let deep = if deep { "; deep parts must be flattened" } else { "" };
        return Err((format!("none of its channels are colours: {}{deep}", listed(headers)), NAMES));
    };
    if best.rank == Rank::Pass && found.iter().filter(|p| p.kind == best.kind).count() > 1 {
        let why = format!("it is not clear which of its passes is the picture: {}", listed(headers));
        return Err((why, NAMES));
    }
    let picture = found.swap_remove(0);
    let list = &headers[picture.part].channels.list;
    if let Some(c) = picture.channels.iter().find(|c| list[**c].sampling != Vec2(1, 1)) {
        let why = format!("its channel {} does not hold every texel", list[*c].name);
        return Err((why, "save it with R, G and B of full size"));
    }
    Ok(picture)
}

/// Names of all channels.
fn listed(headers: &[Header]) -> String {
    let all: Vec<String> =
        headers.iter().flat_map(|h| &h.channels.list).map(|channel| channel.name.to_string()).collect();
    let more = all.len().saturating_sub(LISTED);
    let names = all[..all.len() - more].join(", ");
    if more > 0 { format!("{names} and {more} more") } else { names }
}

/// The pictures of one part, in the order of their first channels.
fn pictures(part: usize, header: &Header) -> Vec<Picture> {
    // By prefix: the indices of R, G, B, Y, RY, BY, X and A.
    let mut groups: Vec<(String, [Option<usize>; 8])> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for (i, channel) in header.channels.list.iter().enumerate().filter(|_| !header.deep) {
        let name = channel.name.to_string();
        let (prefix, leaf) = name.rsplit_once('.').unwrap_or(("", &name));
        let slot = match leaf.to_lowercase().as_str() {
            "r" | "red" => 0,
            "g" | "green" => 1,
            "b" | "blue" => 2,
            "y" => 3,
            "ry" => 4,
            "by" => 5,
            "x" => 6,
            "a" | "alpha" => 7,
            _ => continue,
        };
        let place = *places.entry(prefix.to_owned()).or_insert_with(|| {
            groups.push((prefix.to_owned(), [None; 8]));
            groups.len() - 1
        });
        groups[place].1[slot].get_or_insert(i);
    }
    let part_name = header.own_attributes.layer_name.as_ref().map(|n| n.to_string()).unwrap_or_default();
    let picture = |(prefix, slots): (String, [Option<usize>; 8])| {
        let (kind, channels) = match slots {
            [Some(r), Some(g), Some(b), ..] => (Kind::Rgb, [r, g, b]),
            [_, _, _, Some(y), Some(ry), Some(by), ..] => (Kind::Chroma, [ry, y, by]),
            // Beside an X, Y is a direction.
            [_, _, _, Some(y), _, _, None, _] => (Kind::Grey, [y; 3]),
            _ => return None,
        };
        let name = if prefix.is_empty() { &part_name } else { &prefix };
        let last = name.rsplit('.').next().unwrap_or_default().to_lowercase();
        let rank = match (prefix.is_empty(), name.is_empty()) {
            (true, true) => Rank::Plain,
            _ if WHOLE.contains(&last.as_str()) => Rank::Named,
            (true, false) => Rank::InPart,
            (false, _) => Rank::Pass,
        };
        Some(Picture { part, kind, channels, alpha: slots[7], rank })
    };
    groups.into_iter().filter_map(picture).collect()
}
