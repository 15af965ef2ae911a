//! Modified Newton: decides when an iteration keeps its tangent and when it forms another.
//!
//! A correction with an old tangent costs an evaluation of forces and a substitution; one with a
//! new tangent costs an evaluation of both and a factorisation, about three times as much. If a new
//! tangent has reduced the residual by the factor theta, it reduces the next one by about 2 theta
//! (Deuflhard 2011, doi:10.1007/978-3-642-23899-4, section 2.1): it is kept if this leads to
//! equilibrium soon enough. If a residual is round-off, its ratios mean nothing: the tangent of
//! such an iterate is formed once and kept as long as corrections decrease. Only residuals and
//! counts decide, never a clock.

/// Expected residual, relative to its tolerance, below which the next iterate is expected to
/// converge.
const EXPECTED_RESIDUAL_RATIO: f64 = 0.1;

/// Ratio of the reductions of the residual by the second and by the first correction with one
/// tangent: twice the value of theory.
const KEPT_TANGENT_FACTOR: f64 = 4.0;

/// Number of corrections with an old tangent that cost less than one with a new tangent
const CHEAP_CORRECTIONS: i32 = 2;

/// Observes successive solutions and decides about their tangents.
#[derive(Debug)]
pub(super) struct Reuse {
    /// Largest residual of each iterate of the current solution, relative to its tolerance
    pub(super) history: Vec<f64>,
    /// True if the current tangent is that of an iterate nearby
    kept: bool,
    /// True if the residual of the current iterate is round-off
    noisy: bool,
    /// True if the iterate of the tangent differs from the current one by round-off only
    fine: bool,
    /// True if the last correction was computed with the tangent of its iterate
    own: bool,
    /// Number of tangents that the current solution has required so far
    needed: usize,
    /// Number of tangents that the last solution has required; `usize::MAX` before the first
    pub(super) before: usize,
}

impl Reuse {
    pub fn new() -> Self {
        Self { history: Vec::new(), kept: false, noisy: false, fine: false, own: false, needed: 0, before: usize::MAX }
    }

    /// Begins a solution; `kept` if the tangent is, except for loads, that of its first iterate.
    pub fn begin(&mut self, kept: bool) {
        self.history.clear();
        self.kept = kept;
        self.own = false;
        self.needed = 0;
        self.noisy = false;
        self.fine = false;
    }

    /// Records the residual of the current iterate, relative to its tolerance; `noisy` if it is
    /// round-off.
    pub fn look(&mut self, residual: f64, noisy: bool) {
        self.history.push(residual);
        self.noisy = noisy;
    }

    /// Ends a solution that has converged.
    pub fn end(&mut self) {
        self.before = self.needed;
    }

    /// True if the next evaluation should form the tangent, too: equilibrium is not expected, and
    /// the last solution required another tangent at this point.
    pub fn expects_tangent(&self) -> bool {
        match self.history.is_empty() {
            true => !self.kept,
            false if self.serves_on() => false,
            false => self.noisy || !(self.expects_balance() || (self.kept && self.needed == self.before)),
        }
    }

    /// True if residuals have decreased so fast that the next iterate is expected to converge.
    pub fn expects_balance(&self) -> bool {
        self.will_do(1)
    }

    /// True if the current tangent is that of an iterate nearby.
    pub fn has_tangent(&self) -> bool {
        self.kept
    }

    /// True if the current iterate is to be corrected with the current tangent.
    pub fn keeps_tangent(&self) -> bool {
        if self.noisy { self.serves_on() } else { self.brings_balance() }
    }

    /// True if the current tangent is that of the current iterate except for round-off.
    fn serves_on(&self) -> bool {
        self.kept && self.fine
    }

    /// True if the current tangent is expected to lead to equilibrium soon enough.
    fn brings_balance(&self) -> bool {
        self.kept && (self.begins() || self.will_do(CHEAP_CORRECTIONS))
    }

    /// True at the first iterate, whose tangent may have been given.
    fn begins(&self) -> bool {
        self.history.len() == 1
    }

    /// Records that the tangent of the iterate is formed, to be used unless the iterate has
    /// converged; `leaps` if the next correction includes prescribed increments.
    pub fn form(&mut self, leaps: bool) {
        self.needed += usize::from(!self.brings_balance());
        self.kept = true;
        self.own = true;
        self.fine = self.noisy && !leaps;
    }

    /// Records that the iterate is corrected with the current tangent.
    pub fn keep(&mut self) {
        self.own = self.begins();
    }

    /// True if the current correction is computed with the tangent of its iterate.
    pub fn is_own(&self) -> bool {
        self.own
    }

    /// Discards the current tangent, since charts have changed, or corrections with it do not
    /// decrease.
    pub fn forget(&mut self) {
        self.kept = false;
    }

    /// True if residuals have decreased so fast that the iterate after this many corrections is
    /// expected to converge.
    fn will_do(&self, corrections: i32) -> bool {
        let [.., before, last] = self.history[..] else { return false };
        let factor = if self.own && corrections > 1 { KEPT_TANGENT_FACTOR * last / before } else { last / before };
        last * factor.powi(corrections) < EXPECTED_RESIDUAL_RATIO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of tangents formed in a solution with these residuals, and number of superfluous
    /// evaluations.
    fn solve(reuse: &mut Reuse, residuals: &[f64]) -> (usize, usize) {
        let mut formed = 0;
        let mut twice = 0;
        reuse.begin(false);
        for &residual in residuals {
            let forms = reuse.expects_tangent();
            reuse.look(residual, false);
            if residual <= 1.0 {
                break;
            }
            if forms || !reuse.keeps_tangent() {
                formed += 1;
                twice += usize::from(!forms);
                reuse.form(false);
            } else {
                reuse.keep();
            }
        }
        reuse.end();
        (formed, twice)
    }

    #[test]
    fn a_tangent_is_kept_where_it_will_do() {
        let mut reuse = Reuse::new();
        let fast = [1e9, 1e2, 1e-3];
        // The first solution has no precedent; in the second the second evaluation forms no
        // tangent.
        assert_eq!(solve(&mut reuse, &fast), (2, 0));
        assert_eq!(solve(&mut reuse, &fast), (1, 0));
    }

    #[test]
    fn a_tangent_is_formed_where_the_old_one_is_slow() {
        let mut reuse = Reuse::new();
        let slow = [1e9, 5e8, 1e8, 1e7, 1e-1];
        assert_eq!(solve(&mut reuse, &slow), (4, 0));
        // The number of tangents of the last solution is tried again, and given up if it does not
        // suffice.
        solve(&mut reuse, &[1e9, 1e2, 1e-3]);
        assert_eq!(solve(&mut reuse, &slow), (4, 1));
        assert_eq!(solve(&mut reuse, &slow), (4, 0));
    }

    #[test]
    fn a_given_tangent_serves_until_charts_change() {
        let mut reuse = Reuse::new();
        reuse.begin(true);
        assert!(!reuse.expects_tangent());
        reuse.look(10.0, false);
        assert!(reuse.keeps_tangent());
        // The given tangent is that of the iterate, so the linear solve is checked as with a new
        // one.
        reuse.keep();
        assert!(reuse.is_own());
        reuse.look(1.5, false);
        reuse.keep();
        assert!(!reuse.is_own());
        reuse.forget();
        assert!(!reuse.keeps_tangent());
    }
    #[test]
    fn a_tangent_of_an_iterate_at_round_off_serves_on() {
        let mut reuse = Reuse::new();
        reuse.begin(false);
        reuse.look(1e9, false);
        reuse.form(false);
        // A tangent from further away is not kept.
        reuse.look(0.5, true);
        assert!(reuse.expects_tangent() && !reuse.keeps_tangent());
        reuse.form(false);
        for residual in [0.4, 0.6] {
            reuse.look(residual, true);
            assert!(!reuse.expects_tangent() && reuse.keeps_tangent());
            reuse.keep();
        }
        // Nor is it kept if the residual exceeds round-off again, or charts have changed.
        reuse.look(30.0, false);
        assert!(!reuse.keeps_tangent());
        reuse.look(0.5, true);
        reuse.forget();
        assert!(reuse.expects_tangent() && !reuse.keeps_tangent());
    }

    #[test]
    fn a_tangent_before_prescribed_increments_does_not_serve_on() {
        let mut reuse = Reuse::new();
        reuse.begin(false);
        reuse.look(0.5, true);
        reuse.form(true);
        reuse.look(0.5, true);
        assert!(reuse.expects_tangent() && !reuse.keeps_tangent());
    }
}
