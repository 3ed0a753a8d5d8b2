//! Check of a binary file of USD before the crate `openusd` reads it.
//!
//! `openusd` 0.6 takes the memory that a file's numbers ask for, indexes without a check, and walks the tree
//! of paths as often as a broken one says. All that is looked at here first, so that no damaged file reaches
//! these places: sections, numbers of things, indices, and the tree.

use super::bytes::{Bytes, decompressed, ints, may_hold_ints};
use crate::model::budget::Budget;
use crate::util::error::Error;

/// First letters of a binary file.
pub(super) const MAGIC: &[u8; 8] = b"PXR-USDC";
/// Most sections of a file.
const MOST_SECTIONS: usize = 63;
/// Bytes of memory for a token, a field, a spec and a path, with what the reading needs beside them. Measured
/// with openusd 0.6.0, and rounded up.
const TOKEN: u128 = 64;
const FIELD: u128 = 64;
const SPEC: u128 = 160;
const PATH: u128 = 160;
/// Bytes of memory for an integer while its row is decoded, here and in the crate.
const INT: u128 = 24;

/// What the values of a file are checked with.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// Version: minor number.
    pub version: u8,
    /// Number of tokens.
    pub tokens: usize,
}

/// Why a file is refused, without its name.
pub(super) enum Fault {
    /// The format is broken.
    Broken(&'static str),
    /// The memory does not suffice.
    Memory(Error),
}

type Checked<T> = Result<T, Fault>;

/// The fault of a part that is broken.
fn broken(part: &'static str) -> impl Fn() -> Fault {
    move || Fault::Broken(part)
}

/// Counts memory.
fn take(budget: &mut Budget, bytes: u128, what: &str) -> Checked<()> {
    budget.take(bytes, || what.into()).map_err(Fault::Memory)
}

/// Checks the structure of a file, and counts the memory that reading it takes.
pub(super) fn check(all: &[u8], what: &str, budget: &mut Budget) -> Checked<Layout> {
    let mut head = Bytes::at(all, MAGIC.len() as u64).ok_or_else(broken("head"))?;
    let version = head.take(8).ok_or_else(broken("head"))?;
    let (major, minor) = (version[0], version[1]);
    if major != 0 {
        return Err(Fault::Broken("version"));
    }
    if minor < 4 {
        return Err(Fault::Broken("old version"));
    }
    let toc = head.u64().ok_or_else(broken("head"))?;
    let sections = Sections::read(all, toc).ok_or_else(broken("list of sections"))?;
    let lengths = sections.tokens(what, budget)?;
    sections.strings(what, budget)?;
    sections.fields(what, budget)?;
    sections.fieldsets(what, budget)?;
    sections.paths(&lengths, what, budget)?;
    sections.specs(what, budget)?;
    Ok(Layout { version: minor, tokens: lengths.len() })
}

/// Sections of a file: names and places.
struct Sections<'a> {
    all: &'a [u8],
    places: Vec<(&'a [u8], u64)>,
}

impl<'a> Sections<'a> {
    fn read(all: &'a [u8], toc: u64) -> Option<Sections<'a>> {
        let mut list = Bytes::at(all, toc)?;
        let count = list.count().filter(|count| (1..=MOST_SECTIONS).contains(count))?;
        let mut places = Vec::with_capacity(count);
        for _ in 0..count {
            let name = list.take(16)?;
            let end = name.iter().position(|byte| *byte == 0)?;
            let (start, _size) = (list.u64()?, list.u64()?);
            places.push((&name[..end], start));
        }
        Some(Sections { all, places })
    }

    /// Bytes from the start of a section; `None` for one that the file lacks or that begins behind its end.
    fn find(&self, name: &'static str) -> Checked<Option<Bytes<'a>>> {
        let place = self.places.iter().find(|(own, _)| *own == name.as_bytes());
        place.map(|(_, start)| Bytes::at(self.all, *start).ok_or_else(broken(name))).transpose()
    }

    /// Lengths of the tokens.
    fn tokens(&self, what: &str, budget: &mut Budget) -> Checked<Vec<usize>> {
        const NAME: &str = "TOKENS";
        let Some(mut section) = self.find(NAME)? else { return Ok(Vec::new()) };
        let broken = broken(NAME);
        let count = section.count().ok_or_else(&broken)?;
        let length = section.count().ok_or_else(&broken)?;
        let block = section.block().ok_or_else(&broken)?;
        take(budget, 3 * length as u128 + TOKEN * count as u128, what)?;
        let text = decompressed(block, length).filter(|text| text.len() == length).ok_or_else(&broken)?;
        if text.is_empty() && count == 0 {
            return Ok(Vec::new());
        }
        let text = text.strip_suffix(&[0]).ok_or_else(&broken)?;
        if text.iter().filter(|byte| **byte == 0).count() + 1 != count {
            return Err(broken());
        }
        Ok(text.split(|byte| *byte == 0).map(<[u8]>::len).collect())
    }

    fn strings(&self, what: &str, budget: &mut Budget) -> Checked<()> {
        const NAME: &str = "STRINGS";
        let Some(mut section) = self.find(NAME)? else { return Ok(()) };
        let count = section.count().filter(|count| *count <= section.left() / 4);
        take(budget, 12 * count.ok_or_else(broken(NAME))? as u128, what)
    }

    fn fields(&self, what: &str, budget: &mut Budget) -> Checked<()> {
        const NAME: &str = "FIELDS";
        let Some(mut section) = self.find(NAME)? else { return Ok(()) };
        let broken = broken(NAME);
        let count = section.count().ok_or_else(&broken)?;
        take(budget, FIELD * count as u128, what)?;
        row(&mut section, count).ok_or_else(&broken)?;
        let block = section.block().ok_or_else(&broken)?;
        let values = decompressed(block, 8 * count).ok_or_else(&broken)?;
        if values.len() == 8 * count { Ok(()) } else { Err(broken()) }
    }

    fn fieldsets(&self, what: &str, budget: &mut Budget) -> Checked<()> {
        const NAME: &str = "FIELDSETS";
        let Some(mut section) = self.find(NAME)? else { return Ok(()) };
        let count = section.count().ok_or_else(broken(NAME))?;
        take(budget, INT * count as u128, what)?;
        row(&mut section, count).map(drop).ok_or_else(broken(NAME))
    }

    fn specs(&self, what: &str, budget: &mut Budget) -> Checked<()> {
        const NAME: &str = "SPECS";
        let Some(mut section) = self.find(NAME)? else { return Ok(()) };
        let count = section.count().ok_or_else(broken(NAME))?;
        take(budget, (SPEC + 3 * INT) * count as u128, what)?;
        for _ in 0..3 {
            row(&mut section, count).ok_or_else(broken(NAME))?;
        }
        Ok(())
    }

    /// Walks the tree of paths as the crate does: each entry once, tokens that exist, no path over the
    /// budget.
    fn paths(&self, tokens: &[usize], what: &str, budget: &mut Budget) -> Checked<()> {
        const NAME: &str = "PATHS";
        let Some(mut section) = self.find(NAME)? else { return Ok(()) };
        let broken = broken(NAME);
        let count = section.count().ok_or_else(&broken)?;
        let encoded = section.count().filter(|encoded| *encoded <= count).ok_or_else(&broken)?;
        take(budget, PATH * count as u128 + 3 * INT * encoded as u128, what)?;
        let places = row(&mut section, encoded).ok_or_else(&broken)?;
        let names = row(&mut section, encoded).ok_or_else(&broken)?;
        let jumps = row(&mut section, encoded).ok_or_else(&broken)?;
        // The crate puts the root at the first place, whatever its index is.
        if places.first().is_some_and(|first| *first != 0) {
            return Err(broken());
        }
        let mut seen = vec![false; encoded];
        let mut pending = if encoded == 0 { Vec::new() } else { vec![(0, 0u128)] };
        let mut letters = 0u128;
        while let Some((mut index, mut parent)) = pending.pop() {
            loop {
                if index >= encoded || seen[index] || places[index] as usize >= count {
                    return Err(broken());
                }
                seen[index] = true;
                let token = names[index].cast_signed().unsigned_abs() as usize;
                let name = if index == 0 { Some(&0) } else { tokens.get(token) };
                let path = parent + *name.ok_or_else(&broken)? as u128 + 1;
                letters += path;
                let jump = jumps[index].cast_signed();
                let (has_child, has_sibling) = (jump > 0 || jump == -1, jump >= 0);
                if has_child && has_sibling {
                    pending.push((index + jump as usize, parent));
                }
                if has_child {
                    parent = path;
                }
                if !(has_child || has_sibling) {
                    break;
                }
                index += 1;
            }
        }
        // A copy in the list, one in the table, one in the list of prims.
        take(budget, 3 * letters, what)
    }
}

/// The next row of integers of a section.
fn row(section: &mut Bytes, count: usize) -> Option<Vec<u32>> {
    let block = section.block()?;
    if count == 0 {
        return Some(Vec::new());
    }
    if !may_hold_ints(block, count) { None } else { ints(block, count) }
}
