//! Numbers of frames in the names of files.

/// Most digits that a placeholder may ask for. File systems allow names of 255 bytes.
const MOST_DIGITS: usize = 200;

/// Notation of the frame's number in a file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Notation {
    /// `####`: one digit for each.
    Hashes,
    /// `%04d` or `%d`, as in C, FFmpeg and Nuke.
    Percent,
    /// `$F4` or `$F`, as in Houdini.
    Dollar,
    /// `@@@@`: one digit for each, at least two, as in Houdini's and RV's file sequences.
    Ats,
}

impl Notation {
    /// All notations. The first one that a name contains counts; the others are text in it.
    const ALL: [Notation; 4] = [Notation::Hashes, Notation::Percent, Notation::Dollar, Notation::Ats];

    /// Parses a placeholder at the start of a text. Returns its digits and its length in bytes.
    pub fn parse(self, text: &str) -> Option<(usize, usize)> {
        let run = |c: char, least: usize| {
            let count = text.len() - text.trim_start_matches(c).len();
            (count >= least).then_some((count, count))
        };
        let digits = |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let found = match self {
            Notation::Hashes => run('#', 1),
            Notation::Ats => run('@', 2),
            Notation::Percent => {
                let rest = text.strip_prefix('%')?;
                let count = digits(rest);
                let wide = count == 0 || rest.starts_with('0');
                (wide && rest[count..].starts_with('d'))
                    .then(|| (rest[..count].parse().unwrap_or(1), count + 2))
            }
            Notation::Dollar => {
                let rest = text.strip_prefix("$F")?;
                let count = digits(rest);
                let ends = !rest[count..].starts_with(|c: char| c.is_alphanumeric());
                (count > 0 || ends).then(|| (rest[..count].parse().unwrap_or(1), count + 2))
            }
        };
        found.map(|(digits, bytes)| (digits.clamp(1, MOST_DIGITS), bytes))
    }

    /// Returns the notation of a file name, if it has one.
    pub fn of(name: &str) -> Option<Notation> {
        let occurs =
            |notation: &Notation| name.char_indices().any(|(i, _)| notation.parse(&name[i..]).is_some());
        Notation::ALL.into_iter().find(occurs)
    }
}

/// Writes a frame's number, padded with zeros to at least `digits` characters. As in C, the sign of a frame
/// before 0 counts among them.
pub(crate) fn padded(number: i64, digits: usize) -> String {
    format!("{number:0digits$}")
}

/// Returns a file name with a number in the place of each placeholder; `None` if it has none.
pub(crate) fn numbered(name: &str, number: i64) -> Option<String> {
    let notation = Notation::of(name)?;
    let (mut made, mut rest) = (String::new(), name);
    while let Some(first) = rest.chars().next() {
        rest = match notation.parse(rest) {
            Some((digits, bytes)) => {
                made.push_str(&padded(number, digits));
                &rest[bytes..]
            }
            None => {
                made.push(first);
                &rest[first.len_utf8()..]
            }
        };
    }
    Some(made)
}

/// Returns what a file name has before its first placeholder and behind its last one; `None` if it has none.
pub(crate) fn ends(name: &str) -> Option<(&str, &str)> {
    let notation = Notation::of(name)?;
    let places = || name.char_indices().filter(|(i, _)| notation.parse(&name[*i..]).is_some());
    let (first, last) = (places().next()?.0, places().next_back()?.0);
    let (_, bytes) = notation.parse(&name[last..])?;
    Some((&name[..first], &name[last + bytes..]))
}
