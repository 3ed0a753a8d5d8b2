//! The words by which scene files name the variants of an enum.

/// Gives an enum without fields the words of its variants: `WORDS`, `word` and `from_word`.
///
/// The first word is the parameter's default. `word` matches every variant, so a variant that has no word
/// does not compile.
macro_rules! words {
    ($Enum:ident { $($Variant:ident => $word:literal),+ $(,)? }) => {
        impl $Enum {
            /// The variants' words in scene files; the first is the default.
            pub const WORDS: &'static [&'static str] = &[$($word),+];

            /// Returns the variant's word in scene files.
            pub const fn word(self) -> &'static str {
                match self {
                    $(Self::$Variant => $word),+
                }
            }

            /// Returns the variant that has this word.
            pub fn from_word(word: &str) -> Option<Self> {
                [$(Self::$Variant),+].into_iter().find(|variant| variant.word() == word)
            }
        }
    };
}

pub(crate) use words;
