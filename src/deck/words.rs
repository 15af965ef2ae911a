//! Words of the deck and the values that they stand for: one row for each.

/// A value that a deck gives by one of a few words.
pub trait Words: Copy + 'static {
    /// All values, in the order of messages.
    const ALL: &'static [Self];

    /// The word of a value.
    fn word(self) -> &'static str;

    /// The value of a word.
    fn of(word: &str) -> Option<Self> {
        Self::values().find(|value| value.word() == word)
    }

    /// All words.
    fn words() -> impl Iterator<Item = &'static str> {
        Self::values().map(Self::word)
    }

    /// All values.
    fn values() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied()
    }
}

/// Declares an enum with the word of each variant: `Variant = "word",`.
macro_rules! words {
    ($(#[$of_enum:meta])* pub enum $name:ident { $($(#[$of_variant:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$of_enum])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[$of_variant])* $variant,)+
        }

        impl $crate::deck::Words for $name {
            const ALL: &'static [Self] = &[$(Self::$variant),+];

            fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }
        }
    };
}

pub(crate) use words;
