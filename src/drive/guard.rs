//! Watches the total energy of a dynamic stage.

use super::ledger::Ledger;

/// So many steps running the energy must be too large: a single peak is the trapezoidal rule of the account.
const RUNNING: usize = 3;

/// Follows the total from the start of a stage.
#[derive(Clone, Debug)]
pub(super) struct EnergyGuard {
    limit: f64,
    floor: f64,
    round_off: f64,
    start: Option<f64>,
    largest: f64,
    running: usize,
    lost: f64,
}

/// By how much the total has grown, and what that is to be compared with.
pub(super) struct Growth {
    pub grown: f64,
    pub largest: f64,
}

impl EnergyGuard {
    /// The total may grow by `limit` times the largest |kinetic| + |strain| + |external| so far. Energies below `floor` are
    /// round-off: what Newton tolerates, and on the way the work of forces as large as `round_off`.
    pub fn new(limit: f64, floor: f64, round_off: f64) -> Self {
        Self { limit, floor, round_off, start: None, largest: 0.0, running: 0, lost: 0.0 }
    }

    /// The account where the stage begins; `round_off` is the work of the forces there on the way that places are rounded by.
    pub fn open(&mut self, ledger: Ledger, round_off: f64) {
        self.floor += round_off;
        self.start = Some(ledger.total());
        self.largest = size(ledger);
    }

    /// What the scheme has taken of the energy, as part of the largest, where that is more than may be gained.
    pub fn loss(&self) -> Option<f64> {
        let share = self.lost / self.largest;
        (share > self.limit && self.largest > self.floor).then_some(share)
    }

    /// Looks at the account of a step over which nodes have moved by `moved` at most; tells a growth that lasts.
    pub fn judge(&mut self, ledger: Ledger, moved: f64) -> Option<Growth> {
        self.floor += self.round_off * moved;
        self.largest = self.largest.max(size(ledger));
        let grown = ledger.total() - self.start?;
        self.lost = self.lost.max(-grown);
        let grows = grown > self.limit * self.largest && self.largest > self.floor;
        self.running = if grows { self.running + 1 } else { 0 };
        (self.running >= RUNNING).then_some(Growth { grown, largest: self.largest })
    }
}

fn size(ledger: Ledger) -> f64 {
    ledger.kinetic.abs() + ledger.strain.abs() + ledger.external.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ledger(kinetic: f64) -> Ledger {
        Ledger { kinetic, ..Ledger::default() }
    }

    #[test]
    fn growth_that_lasts_three_steps_is_told() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
        guard.open(ledger(1.0), 0.0);
        assert!(guard.judge(ledger(1.2), 0.0).is_none());
        assert!(guard.judge(ledger(1.3), 0.0).is_none());
        assert!(guard.judge(ledger(1.1), 0.0).is_none());
        assert!(guard.judge(ledger(1.3), 0.0).is_none());
        assert!(guard.judge(ledger(1.3), 0.0).is_none());
        assert!(guard.loss().is_none());
        let growth = guard.judge(ledger(1.4), 0.0).unwrap();
        assert!((growth.grown - 0.4).abs() < 1e-15 && growth.largest == 1.4);
    }

    #[test]
    fn forces_of_round_off_do_work_on_the_way() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 1e-3);
        guard.open(ledger(0.0), 0.0);
        assert!((1..10).all(|k| guard.judge(ledger(5e-4 * f64::from(k)), 1.0).is_none()));
        let mut still = guard.clone();
        assert!((10..14).any(|k| still.judge(ledger(5e-3 * f64::from(k)), 0.0).is_some()));
    }

    #[test]
    fn what_places_are_rounded_by_is_no_growth() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
        guard.open(ledger(0.0), 1e-15);
        assert!((1..10).all(|k| guard.judge(ledger(1e-16 * f64::from(k)), 0.0).is_none()));
        assert!((10..14).any(|k| guard.judge(ledger(1e-15 * f64::from(k)), 0.0).is_some()));
    }

    #[test]
    fn what_is_lost_is_told_beyond_the_limit() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
        guard.open(ledger(1.0), 0.0);
        assert!(guard.judge(ledger(0.9), 0.0).is_none() && guard.loss().is_none());
        assert!(guard.judge(ledger(0.5), 0.0).is_none());
        assert_eq!(guard.loss(), Some(0.5));
    }
}
