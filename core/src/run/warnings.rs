//! Warnings of any kind of stage, each given once.

use super::energy::is_unbalanced;
use super::failure::Moment;
use super::findings::Warning;
use super::issued::FrictionReversals;
use super::stage_run::StageRun;
use crate::effect::{ElasticStick, Penetration, RoundOff};
use crate::interrupt;
use crate::kernel::Weights;
use crate::model::charts;
use crate::solve::{Convergence, Verdict, size};
use crate::system::Slot;
use crate::tensor::Vec3;
use crate::warning::WarningKind;

/// The largest relative error of the curvature of two-node elements with total vectors, over the
/// square of the relative rotation of their nodes: measured over 4000 orientations.
const FRAME_ERROR: f64 = 0.0533;

/// The tolerance, relative, of a balance that a stage before has found.
const LOOSE_BALANCE: f64 = 1e-5;

/// A motion below this, in lengths of the scene and radians, is round-off.
const MOVED: f64 = 1e-12;

/// The part of the strain energy from which on the energy of elastic stick is told: leaves of a spring that are ten times
/// too soft have 0.1, and scenes of `decks/contact` 0.0001 to 0.034.
const MOST_HELD_BY_STICK: f64 = 0.05;
/// What friction misses at a reversal, over the energy F^2/(2 k) that its springs give back there and take up again in the
/// other direction: on that way of 2 F/k sliding takes F 2 F/k.
const MISSED_AT_REVERSAL: f64 = 4.0;
/// The part of what friction takes from which on it is told that it is missed at reversals: six random pairs of leaves that
/// slide to and fro and lose 12 to 26 % too little have 0.07 to 0.19, ropes and rods that slide one way less than 0.006.
const MOST_MISSED: f64 = 0.05;
/// The part of the strain energy that friction has to take before what it takes is judged: ropes that settle on a drum in
/// a few levels take less.
const LEAST_TAKEN: f64 = 0.5;
/// The part of the energy of elastic stick below which strain energy is none: bodies on slopes strain nothing.
const LEAST_STRAIN: f64 = 0.05;

/// The way that friction may give, over the radius.
const MOST_GIVEN: f64 = 0.2;

impl StageRun<'_> {
    /// Warns of something at the present moment.
    pub fn warn(&mut self, kind: WarningKind, message: impl Into<String>) {
        self.warn_at(kind, self.moment(), message);
    }

    /// Warns of something that happened at some moment.
    pub fn warn_at(&mut self, kind: WarningKind, at: Moment, message: impl Into<String>) {
        // An interrupted look tells nothing.
        if interrupt::is_requested() && !self.is_judged {
            return;
        }
        let warning = Warning { kind, at: Some(at), message: message.into() };
        self.observer.warn(&warning);
        self.counters.findings.warnings.push(warning);
    }

    /// Says where the answer has fewer digits than it shows.
    pub fn warn_of_round_off(&mut self) {
        let uncertainty = self.counters.work.uncertainty;
        if uncertainty > 10.0 * self.issued.uncertainty {
            self.issued.uncertainty = uncertainty;
            let message = format!(
                "about {:.0} of 16 digits are lost to round-off: displacements are uncertain by about \
                 {uncertainty:.0e} of the largest (typical of very slender beams on very fine meshes: use fewer \
                 elements of a higher order)",
                16.0 + uncertainty.log10()
            );
            self.warn(WarningKind::LostDigits, message);
        }
    }

    /// The tangent has lost the stiffness of a motion that something holds.
    pub fn warn_of_softness(&mut self) {
        self.soft = true;
        if !std::mem::replace(&mut self.issued.soft, true) {
            self.warn(
                WarningKind::LostStiffness,
                "the stiffness of the softest mode is a difference of terms that are more than 1e15 times larger: a \
                 linear solve loses all 16 digits of it; iterative refinement is used as long as it helps (fewer \
                 elements of a higher order lose less)",
            );
        }
    }

    /// A modal or buckling stage about a state that is not in balance.
    pub fn warn_out_of_balance(&mut self) {
        self.assembly.forget();
        self.assembly.evaluate(self.state, Weights::NONE, None);
        if !self.is_nearly_balanced() && self.is_away_from_equilibrium() {
            let message = "the modal or buckling stage does not start from an equilibrium: put a static stage before \
                           it";
            self.warn(WarningKind::OutOfBalance, message);
        }
    }

    /// True if the forces that were evaluated last are in balance, or nearly so.
    pub fn is_nearly_balanced(&self) -> bool {
        let loose = Convergence { tolerance: LOOSE_BALANCE, negligible: 0.0 };
        let is_balanced_within = |round_off| {
            let verdict = loose.judge(self.model, &self.assembly.system, round_off, None).verdict;
            matches!(verdict, Verdict::Converged | Verdict::Noisy)
        };
        is_balanced_within(RoundOff::default()) || is_balanced_within(self.assembly.round_off(self.state))
    }

    /// True if Newton's first correction moves the state noticeably. Where no force but round-off acts
    /// its balance tells nothing.
    fn is_away_from_equilibrium(&mut self) -> bool {
        let Self { assembly, newton, state, model, counters, .. } = self;
        assembly.forget();
        assembly.evaluate(state, Weights::STIFFNESS, None);
        let mut correction = vec![Vec3::ZERO; state.q.len()];
        counters.work.factorisations += 1;
        let solver = &mut newton.solver;
        let is_known =
            solver.factorise(&assembly.system) && solver.correct(&assembly.system, true, None, &mut correction);
        !is_known || size(model, &correction) > MOVED
    }

    /// Begins to look at contacts in a static stage.
    pub fn begin_to_watch_contacts(&mut self) {
        self.issued.hidden = None;
        let taken_before = self.state.contacts.dissipated;
        let in_springs = self.model.contacts().map_or([0.0; 2], |contacts| contacts.energy_of_friction(self.state));
        self.issued.reversals = FrictionReversals { in_springs, taken_before, ..FrictionReversals::default() };
    }

    /// Notes how far contacts of a static stage penetrate between their points in a state that is shown (penetrations at
    /// these are failures), and what energy the springs of friction give back.
    pub fn watch_contacts(&mut self) {
        let Some(contacts) = self.model.contacts() else { return };
        let in_springs = contacts.energy_of_friction(self.state);
        let reversals = &mut self.issued.reversals;
        let back = given_back(reversals.in_springs, in_springs);
        if back > 0.0 {
            reversals.given_back += back;
            reversals.strain = reversals.strain.max(self.model.energy(self.state).strain);
            let softest = contacts.softest_stick(self.state).map(|softest| softest.contact);
            reversals.contact = softest.or(reversals.contact.take());
        }
        reversals.in_springs = in_springs;
        let Some(found) = contacts.hidden_penetration(self.state) else { return };
        if self.issued.hidden.as_ref().is_none_or(|(deepest, _)| found.depth > deepest.depth) {
            self.issued.hidden = Some((found, self.state.load));
        }
    }

    /// Warns of penetrations between the points of contact in a static stage.
    pub fn warn_of_hidden_penetration(&mut self) {
        let Some((Penetration { contact, surface, depth, allowed, .. }, load)) = self.issued.hidden.take() else {
            return;
        };
        let stage = self.number + 1;
        let message = format!(
            "stage {stage}: contact \"{contact}\" penetrates \"{surface}\" by {depth:.3e}, {:.2} times `penetration`, at load \
             factor {load}, between the points that carry forces: use more elements there, or a larger `penetration`",
            depth / allowed
        );
        self.warn(WarningKind::HiddenPenetration, message);
    }

    /// Friction builds up over the way that its springs give.
    pub fn warn_of_soft_stick(&mut self) {
        let Some(contacts) = self.model.contacts() else { return };
        let Some(ElasticStick { contact, way, radius }) = contacts.softest_stick(self.state) else { return };
        let share = way / radius;
        if share <= MOST_GIVEN || std::mem::replace(&mut self.issued.soft_stick, true) {
            return;
        }
        let stage = self.number + 1;
        let message = format!(
            "stage {stage} ends with contact \"{contact}\" held by friction whose elastic part has given way by \
             {way:.2e}, which is {share:.2} of the radius: friction builds up over about that way (give the contact a \
             larger `stick`)"
        );
        self.warn(WarningKind::SoftStick, message);
    }

    /// Warns of elastic stick in a static stage: what it holds at its end is soft, or what slides to and fro loses too
    /// little.
    pub fn warn_of_soft_stick_at_rest(&mut self) {
        let reversals = std::mem::take(&mut self.issued.reversals);
        let Some((contact, told)) = self.soft_holds().or_else(|| self.missed_by(reversals)) else { return };
        if std::mem::replace(&mut self.issued.soft_stick, true) {
            return;
        }
        let stage = self.number + 1;
        let message = format!(
            "stage {stage}: friction of contact \"{contact}\" {told} (use more elements, or give the contact a larger \
             `stiffness` or `stick`)"
        );
        self.warn(WarningKind::SoftStick, message);
    }

    /// Parts that friction holds together are stiff only as far as its springs are: the contact, and what it does.
    fn soft_holds(&self) -> Option<(String, String)> {
        let contacts = self.model.contacts()?;
        let [held, strain] = [contacts.energy_of_holds(self.state), self.model.energy(self.state).strain];
        let is_soft = held > MOST_HELD_BY_STICK * strain && strain > LEAST_STRAIN * held;
        let softest = contacts.softest_stick(self.state).filter(|_| is_soft)?;
        let percent = 100.0 * held / strain;
        let told = format!(
            "holds parts together elastically: its springs store {percent:.0} % of the strain energy, and what they hold may \
             be far too soft"
        );
        Some((softest.contact, told))
    }

    /// Where sliding turns round, friction takes no energy until its springs have turned round, too: the contact, and what it
    /// does.
    fn missed_by(&self, reversals: FrictionReversals) -> Option<(String, String)> {
        let FrictionReversals { given_back, strain, contact, taken_before, .. } = reversals;
        let strain = strain.max(self.model.energy(self.state).strain);
        let [taken, missed] = [self.state.contacts.dissipated - taken_before, MISSED_AT_REVERSAL * given_back];
        let loses = missed > MOST_MISSED * (taken + missed) && taken > LEAST_TAKEN * strain;
        let told = "takes too little energy where parts slide to and fro: after each reversal they first stick elastically, \
                    on a noticeable part of the way";
        Some((contact.filter(|_| loses)?, told.into()))
    }

    /// A stage that ends at rest takes kinetic energy away from what moved before.
    pub fn warn_of_standstill(&mut self) {
        let (Some(first), true) = (self.bookkeeper.first(), self.plan.energy && self.past.moving) else { return };
        let share = (self.bookkeeper.ledger().total() - first) / self.bookkeeper.scale();
        if is_unbalanced(share) && !std::mem::replace(&mut self.issued.unbalanced, true) {
            let stage = self.number + 1;
            let percent = 100.0 * share.abs();
            let message = format!(
                "stage {stage}: energy.total is off by {percent:.0} % of the largest energy: the kinetic energy of the \
                 previous stage was dropped, and work is integrated by the trapezoidal rule between load levels"
            );
            self.warn(WarningKind::EnergyBalance, message);
        }
    }

    /// Total rotation vectors are interpolated in charts that do not turn with the element: the
    /// strains of a turned scene differ.
    pub fn warn_of_frame(&mut self) {
        // Rotations about one axis are interpolated without any error.
        if self.plane.is_some() {
            return;
        }
        let angle = charts::widest_of_two_nodes_in_one_chart(self.state, &self.schedule.charted(self.model).elements);
        let error = FRAME_ERROR * angle * angle;
        if error > self.issued.frame {
            self.issued.frame = 2.0 * error;
            let message = format!(
                "interpolation = \"total\": neighbouring nodes are rotated by up to {angle:.2} rad relative to each \
                 other, so that curvatures of two-node elements depend on the orientation of the scene by up to {:.1} \
                 %; use \"relative\", which has no such error, or shorter elements (the error falls with the square of \
                 their length)",
                100.0 * error
            );
            self.warn(WarningKind::FrameDependence, message);
        }
    }

    /// A node passed a whole turn aside of its axis.
    pub fn warn_of_lost_axis(&mut self, slot: Slot) {
        if !std::mem::replace(&mut self.issued.axis, true) {
            let (at, node) = (self.moment(), self.model.node_at(slot as usize));
            let message = format!(
                "node \"{node}\" changed its axis of rotation near a whole turn ({at}), where the continuous rotation \
                 vector is undefined: from there on `rc` sums increments and depends on the steps (`r` does not)"
            );
            self.warn(WarningKind::LostAxis, message);
        }
    }
}

/// What springs of friction give back from one row to the next where sliding turns round. Given are their energies and those
/// where all points slide: less pressure lowers both alike, and more of it the share of the first in the second.
fn given_back(before: [f64; 2], after: [f64; 2]) -> f64 {
    let share = |[energy, sliding]: [f64; 2]| if sliding > 0.0 { energy / sliding } else { 0.0 };
    let of_share = (share(before) - share(after)) * after[1];
    of_share.min(before[0] - after[0]).max(0.0)
}
