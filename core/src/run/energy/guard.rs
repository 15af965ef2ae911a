//! Watches the total energy of a dynamic stage.

use super::ledger::Ledger;
use serde::{Deserialize, Serialize};

/// Consecutive steps over which the energy must be too large: a single peak is the trapezoidal rule
/// of the account.
const RUNNING: usize = 3;

/// Steps at the start of a stage that may bring energy: a sudden load sets vibrations going that steps do not resolve.
/// What comes behind them is judged.
const UNJUDGED: usize = 10;

/// Follows the total from the start of a stage.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct EnergyGuard {
    limit: f64,
    floor: f64,
    round_off: f64,
    start: Option<f64>,
    largest: f64,
    judged: usize,
    running: usize,
    balance: Balance,
}

/// How far the total departs from that of the run's start, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
struct Balance {
    /// At the start of the run
    first: f64,
    /// At the start of the stage
    start: f64,
    /// The total where it was farthest from that of the run's start, and from that of the stage's
    farthest: [f64; 2],
}

/// The error of an account that should be closed, over the largest kinetic + strain energy or work
/// from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imbalance {
    /// Above zero where energy comes from nothing
    pub(crate) share: f64,
    /// The stage itself is to blame, not those before it.
    pub(crate) is_own: bool,
}

/// An account that is off by more than this part of the largest energy is told.
const UNBALANCED: f64 = 0.05;

/// True if an account that is off by a share of the largest energy is worth a warning.
pub fn is_unbalanced(share: f64) -> bool {
    share.abs() > UNBALANCED
}

/// A stage that is off by more than this part of the whole is to blame.
const TO_BLAME: f64 = 0.4;

/// By how much the total has grown, and what that is to be compared with.
pub struct Growth {
    pub(crate) grown: f64,
    pub(crate) largest: f64,
}

impl EnergyGuard {
    /// The total may grow by `limit` times the largest |kinetic| + |strain| + |external| so far.
    /// Energies below `floor` are round-off: what Newton tolerates, and on the way the work of
    /// forces as large as `round_off`.
    pub fn new(limit: f64, floor: f64, round_off: f64) -> Self {
        Self { limit, floor, round_off, start: None, largest: 0.0, judged: 0, running: 0, balance: Balance::default() }
    }

    /// The account where the stage begins, and the total at the start of the run; `round_off` is
    /// the work of the forces there on the way that places are rounded by.
    pub fn open(&mut self, ledger: Ledger, first: f64, round_off: f64) {
        self.floor += round_off;
        let total = ledger.total();
        self.start = Some(total);
        self.balance = Balance { first, start: total, farthest: [total; 2] };
        self.balance.look(ledger);
        self.largest = size(ledger);
    }

    /// Passes over energies up to one that is round-off.
    pub fn pass_over(&mut self, energy: f64) {
        self.floor = self.floor.max(energy);
    }

    /// The error of the account of the run, if that is worth a warning; `scale` is the largest
    /// energy of the run so far.
    pub fn imbalance(&self, scale: f64) -> Option<Imbalance> {
        // A stage at rest may have lost what stages before it had.
        if self.largest.max(scale) > self.floor { self.balance.imbalance(scale) } else { None }
    }

    /// Looks at the account of a step over which nodes have moved by `moved` at most; tells a
    /// growth that lasts.
    pub fn judge(&mut self, ledger: Ledger, moved: f64) -> Option<Growth> {
        self.floor += self.round_off * moved;
        self.largest = self.largest.max(size(ledger));
        self.balance.look(ledger);
        let (total, start) = (ledger.total(), self.start?);
        self.judged += 1;
        if self.judged <= UNJUDGED {
            self.start = Some(start.max(total));
            return None;
        }
        let grown = total - start;
        let grows = grown > self.limit * self.largest && self.largest > self.floor;
        self.running = if grows { self.running + 1 } else { 0 };
        (self.running >= RUNNING).then_some(Growth { grown, largest: self.largest })
    }
}

impl Balance {
    fn look(&mut self, ledger: Ledger) {
        let total = ledger.total();
        for (farthest, from) in self.farthest.iter_mut().zip([self.first, self.start]) {
            if (total - from).abs() > (*farthest - from).abs() {
                *farthest = total;
            }
        }
    }

    fn imbalance(&self, scale: f64) -> Option<Imbalance> {
        let [of_run, of_stage] = self.farthest;
        let off = of_run - self.first;
        let is_own = (of_stage - self.start).abs() > TO_BLAME * off.abs();
        let share = off / scale;
        is_unbalanced(share).then_some(Imbalance { share, is_own })
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
        guard.open(ledger(1.0), 1.0, 0.0);
        assert!((0..UNJUDGED).all(|_| guard.judge(ledger(1.0), 0.0).is_none()));
        assert!(guard.judge(ledger(1.2), 0.0).is_none());
        assert!(guard.judge(ledger(1.3), 0.0).is_none());
        assert!(guard.judge(ledger(1.1), 0.0).is_none());
        assert!(guard.judge(ledger(1.3), 0.0).is_none());
        assert!(guard.judge(ledger(1.3), 0.0).is_none());
        let growth = guard.judge(ledger(1.4), 0.0).unwrap();
        assert!((growth.grown - 0.4).abs() < 1e-15 && growth.largest == 1.4);
    }

    #[test]
    fn what_the_first_steps_bring_is_no_growth() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
        guard.open(ledger(1.0), 1.0, 0.0);
        assert!((0..UNJUDGED).all(|_| guard.judge(ledger(2.0), 0.0).is_none()));
        assert!((0..9).all(|_| guard.judge(ledger(2.1), 0.0).is_none()));
        assert!((0..3).any(|_| guard.judge(ledger(3.0), 0.0).is_some()));
    }

    #[test]
    fn forces_of_round_off_do_work_on_the_way() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 1e-3);
        guard.open(ledger(0.0), 0.0, 0.0);
        assert!((1..10).all(|k| guard.judge(ledger(5e-4 * f64::from(k)), 1.0).is_none()));
        let mut still = guard.clone();
        assert!((10..17).any(|k| still.judge(ledger(5e-3 * f64::from(k)), 0.0).is_some()));
    }

    #[test]
    fn what_places_are_rounded_by_is_no_growth() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
        guard.open(ledger(0.0), 0.0, 1e-15);
        assert!((1..10).all(|k| guard.judge(ledger(1e-16 * f64::from(k)), 0.0).is_none()));
        assert!((10..17).any(|k| guard.judge(ledger(1e-15 * f64::from(k)), 0.0).is_some()));
    }

    #[test]
    fn an_account_that_is_off_is_told_either_way() {
        let told = |totals: &[f64]| {
            let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
            guard.open(ledger(1.0), 1.0, 0.0);
            totals.iter().for_each(|&total| assert!(guard.judge(ledger(total), 0.0).is_none()));
            guard.imbalance(1.0)
        };
        let own = |share: f64| Some(Imbalance { share, is_own: true });
        assert_eq!(told(&[0.96, 1.04]), None);
        assert_eq!(told(&[0.75, 0.9]), own(-0.25));
        // From step to step to and fro, and never three steps running.
        assert_eq!(told(&[1.5, 0.8, 2.0, 0.5]), own(1.0));
    }

    #[test]
    fn what_the_stages_before_are_off_by_is_theirs() {
        let mut guard = EnergyGuard::new(0.2, 0.0, 0.0);
        guard.open(ledger(1.0), 0.8, 0.0);
        assert!(guard.judge(ledger(1.01), 0.0).is_none());
        assert!(guard.imbalance(1.0).is_some_and(|imbalance| !imbalance.is_own && imbalance.share > 0.2));
    }
}
