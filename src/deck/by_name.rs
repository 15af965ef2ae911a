//! Things with names, in their order, that are also found by name.

use std::collections::HashMap;
use std::ops::{Deref, DerefMut};

/// A thing with a name.
pub trait Named {
    /// Its name.
    fn name(&self) -> &str;
}

/// Things in their order, such as the beams of a deck. Looking one up by its name takes the same time
/// for any number of things. Of things with equal names the first is found.
///
/// Neither names nor the order may be changed through a mutable reference.
#[derive(Clone, Debug)]
pub struct ByName<T> {
    things: Vec<T>,
    numbers: HashMap<String, usize>,
}

impl<T: Named> ByName<T> {
    /// Adds a thing at the end.
    pub fn push(&mut self, thing: T) {
        self.numbers.entry(thing.name().to_string()).or_insert(self.things.len());
        self.things.push(thing);
    }

    /// The number of the thing with a name.
    pub fn number(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// The thing with a name.
    pub fn named(&self, name: &str) -> Option<&T> {
        self.number(name).map(|number| &self.things[number])
    }

    /// All names, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.things.iter().map(T::name)
    }
}

impl<T> Default for ByName<T> {
    fn default() -> Self {
        Self { things: Vec::new(), numbers: HashMap::new() }
    }
}

impl<T: Named> From<Vec<T>> for ByName<T> {
    fn from(things: Vec<T>) -> Self {
        let mut all = Self::default();
        things.into_iter().for_each(|thing| all.push(thing));
        all
    }
}

impl<T> Deref for ByName<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.things
    }
}

impl<T> DerefMut for ByName<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.things
    }
}

impl<'a, T> IntoIterator for &'a ByName<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.things.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut ByName<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.things.iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Named for (&str, u8) {
        fn name(&self) -> &str {
            self.0
        }
    }

    #[test]
    fn the_first_of_equal_names_is_found_and_all_stay_in_order() {
        let all = ByName::from(vec![("b", 1), ("a", 2), ("b", 3)]);
        assert_eq!(all.number("b"), Some(0));
        assert_eq!(all.named("a"), Some(&("a", 2)));
        assert_eq!(all.named("c"), None);
        assert_eq!(all.names().collect::<Vec<_>>(), ["b", "a", "b"]);
    }
}
