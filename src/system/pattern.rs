//! The sparsity pattern of the tangent, and for each element the places its entries go to, worked out once.

use super::equations::Equations;
use super::state::Slot;

/// The slots that meet in each instance of an effect: one clique an element.
#[derive(Clone, Debug, Default)]
pub struct Cliques {
    slots: Vec<Slot>,
    ends: Vec<u32>,
}

impl Cliques {
    /// Adds an instance that couples these slots, in the order of its blocks.
    pub fn push(&mut self, slots: impl IntoIterator<Item = Slot>) {
        self.slots.extend(slots);
        self.ends.push(self.slots.len() as u32);
    }

    /// The number of instances.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is no instance.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The slots of an instance.
    #[inline]
    pub fn get(&self, k: usize) -> &[Slot] {
        let start = if k == 0 { 0 } else { self.ends[k - 1] as usize };
        &self.slots[start..self.ends[k] as usize]
    }

    /// All instances.
    pub fn iter(&self) -> impl Iterator<Item = &[Slot]> {
        (0..self.len()).map(|k| self.get(k))
    }
}

/// Where the entries of one effect's instances go.
#[derive(Clone, Debug)]
pub(super) struct Places {
    pub cliques: Cliques,
    /// By instance and then by rows: the index of the entry's value, [`Pattern::discard`] for entries of held directions.
    pub values: Vec<u32>,
    starts: Vec<usize>,
    /// Instances that touch a held direction or turned axes.
    pub special: Vec<bool>,
}

impl Places {
    #[inline]
    pub fn of(&self, k: usize) -> &[u32] {
        &self.values[self.starts[k]..self.starts[k + 1]]
    }
}

/// The tangent in compressed columns, without its values.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// The equations that the rows and columns stand for.
    pub equations: Equations,
    /// Where each column starts.
    pub column_starts: Vec<u32>,
    /// The row of each entry.
    pub rows: Vec<u32>,
    pub(super) places: Vec<Places>,
}

impl Pattern {
    /// The pattern of several effects, given by the cliques of each.
    pub fn new(equations: Equations, effects: Vec<Cliques>) -> Self {
        let (column_starts, rows) = compressed_columns(&equations, &effects);
        let mut pattern = Self { equations, column_starts, rows, places: Vec::new() };
        pattern.places = effects.into_iter().map(|cliques| pattern.places_of(cliques)).collect();
        pattern
    }

    /// The number of stored entries.
    pub fn nonzeros(&self) -> usize {
        self.rows.len()
    }

    /// The index behind the last value: what is added there is dropped.
    pub fn discard(&self) -> u32 {
        self.rows.len() as u32
    }

    fn places_of(&self, cliques: Cliques) -> Places {
        let mut places = Places {
            values: Vec::new(),
            starts: Vec::with_capacity(cliques.len() + 1),
            special: Vec::with_capacity(cliques.len()),
            cliques: Cliques::default(),
        };
        for slots in cliques.iter() {
            places.starts.push(places.values.len());
            let equations: Vec<u32> = slots.iter().flat_map(|&slot| self.equations.of(slot)).collect();
            for &row in &equations {
                places.values.extend(
                    equations.iter().map(|&column| self.find(row, column).map_or(self.discard(), |k| k as u32)),
                );
            }
            let turned = slots.iter().any(|&slot| self.equations.frame(slot).is_some());
            places.special.push(turned || equations.contains(&Equations::HELD));
        }
        places.starts.push(places.values.len());
        places.cliques = cliques;
        places
    }

    /// Where an entry is stored: `None` for held directions, and for pairs that no effect couples.
    pub fn find(&self, row: u32, column: u32) -> Option<usize> {
        if row == Equations::HELD || column == Equations::HELD {
            return None;
        }
        let start = self.column_starts[column as usize] as usize;
        let end = self.column_starts[column as usize + 1] as usize;
        self.rows[start..end].binary_search(&row).ok().map(|k| start + k)
    }
}

/// Slot by slot the slots it meets, then column by column the equations of those.
fn compressed_columns(equations: &Equations, effects: &[Cliques]) -> (Vec<u32>, Vec<u32>) {
    let slots = 1 + effects.iter().flat_map(|c| c.slots.iter()).max().map_or(0, |&slot| slot as usize);
    let mut meets: Vec<Vec<Slot>> = vec![Vec::new(); slots];
    for clique in effects.iter().flat_map(Cliques::iter) {
        for &slot in clique {
            for other in clique {
                let known = &mut meets[slot as usize];
                if !known.contains(other) {
                    known.push(*other);
                }
            }
        }
    }
    let mut column_starts = vec![0; equations.count() + 1];
    let mut rows = Vec::new();
    for column in 0..equations.count() {
        let slot = equations.direction(column).slot as usize;
        let start = rows.len();
        if let Some(neighbours) = meets.get(slot).filter(|n| !n.is_empty()) {
            for &other in neighbours {
                rows.extend(equations.of(other).into_iter().filter(|&row| row != Equations::HELD));
            }
        } else {
            rows.push(column as u32);
        }
        rows[start..].sort_unstable();
        column_starts[column + 1] = rows.len() as u32;
    }
    (column_starts, rows)
}
