//! When Newton's iteration goes on with the tangent it has (modified Newton), and when it forms
//! another.
//!
//! A correction with an old tangent costs an evaluation of forces and a substitution; one with a
//! new tangent costs an evaluation of both and a factorisation, about three times that. Where a new
//! tangent has made a residual smaller by theta, the same tangent makes the next one smaller by
//! about 2 theta (Deuflhard 2011, doi:10.1007/978-3-642-23899-4, section 2.1): it is kept where so
//! much brings balance soon enough. Where a residual is round-off ratios tell nothing: a tangent of
//! such an iterate is formed once, and serves for all that follow as long as their corrections
//! become smaller. Only residuals and counts decide, never a clock.

/// The ratio of a residual to what is allowed that is expected to become one in balance.
const EXPECTED: f64 = 0.1;

/// The factor of the next residual with the same tangent, over that of the first one: twice what
/// theory has.
const SAME: f64 = 4.0;

/// Corrections with an old tangent that cost less than one with a new one
const CHEAP: i32 = 2;

/// Follows one solution after the other.
#[derive(Debug)]
pub(super) struct Reuse {
    /// The largest residual of each iterate of the present solution, over what is allowed
    pub history: Vec<f64>,
    /// True if there is a tangent near the present iterate
    kept: bool,
    /// True if the residual of the present iterate is round-off
    noisy: bool,
    /// True if nothing but round-off lies between the tangent's iterate and the present one
    fine: bool,
    /// True if the last correction was found with the tangent of its iterate
    own: bool,
    /// The tangents that this solution could not do without so far
    needed: usize,
    /// The tangents that the last solution could not do without, once there is one
    before: usize,
}

impl Reuse {
    pub fn new() -> Self {
        Self { history: Vec::new(), kept: false, noisy: false, fine: false, own: false, needed: 0, before: usize::MAX }
    }

    /// A solution begins; `kept` where the tangent is already that of its first iterate, but for
    /// the loads.
    pub fn begin(&mut self, kept: bool) {
        self.history.clear();
        (self.kept, self.own, self.needed) = (kept, false, 0);
        (self.noisy, self.fine) = (false, false);
    }

    /// The present iterate has this residual, over what is allowed; `noisy` where that is
    /// round-off.
    pub fn look(&mut self, residual: f64, noisy: bool) {
        self.history.push(residual);
        self.noisy = noisy;
    }

    /// A solution has come to balance.
    pub fn end(&mut self) {
        self.before = self.needed;
    }

    /// True if the next evaluation had better form the tangent, too: neither is balance expected,
    /// nor did the last solution need another one from here on.
    pub fn expects_tangent(&self) -> bool {
        match self.history.is_empty() {
            true => !self.kept,
            false if self.serves_on() => false,
            false => self.noisy || !(self.expects_balance() || (self.kept && self.needed == self.before)),
        }
    }

    /// True if residuals have fallen so fast that the next one will do.
    pub fn expects_balance(&self) -> bool {
        self.will_do(1)
    }

    /// True if there is a tangent near the present iterate.
    pub fn has_tangent(&self) -> bool {
        self.kept
    }

    /// True if the tangent that is there shall serve for the present iterate.
    pub fn keeps_tangent(&self) -> bool {
        if self.noisy { self.serves_on() } else { self.brings_balance() }
    }

    /// True if the tangent that is there is that of the present iterate but for round-off.
    fn serves_on(&self) -> bool {
        self.kept && self.fine
    }

    /// True if the tangent that is there is expected to bring balance soon enough.
    fn brings_balance(&self) -> bool {
        self.kept && (self.begins() || self.will_do(CHEAP))
    }

    /// True if this is the first iterate, whose tangent may have been given.
    fn begins(&self) -> bool {
        self.history.len() == 1
    }

    /// The iterate has its own tangent, which is used unless it is in balance; `leaps` where
    /// prescribed increments lie between it and the next.
    pub fn form(&mut self, leaps: bool) {
        self.needed += usize::from(!self.brings_balance());
        (self.kept, self.own) = (true, true);
        self.fine = self.noisy && !leaps;
    }

    /// The iterate is corrected with the tangent that is there.
    pub fn keep(&mut self) {
        self.own = self.begins();
    }

    /// True if the present correction is found with the tangent of its iterate.
    pub fn is_own(&self) -> bool {
        self.own
    }

    /// The tangent that is there serves no more: unknowns have changed their meaning, or
    /// corrections with it do not become smaller.
    pub fn forget(&mut self) {
        self.kept = false;
    }

    /// True if residuals have fallen so fast that after so many corrections more the next one will
    /// do.
    fn will_do(&self, corrections: i32) -> bool {
        let [.., before, last] = self.history[..] else { return false };
        let factor = if self.own && corrections > 1 { SAME * last / before } else { last / before };
        last * factor.powi(corrections) < EXPECTED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many tangents a solution with these residuals forms, and how many evaluations it makes
    /// for nothing.
    fn solve(reuse: &mut Reuse, residuals: &[f64]) -> (usize, usize) {
        let (mut formed, mut twice) = (0, 0);
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
        // Nothing is known at first; from then on the second evaluation forms no tangent.
        assert_eq!(solve(&mut reuse, &fast), (2, 0));
        assert_eq!(solve(&mut reuse, &fast), (1, 0));
    }

    #[test]
    fn a_tangent_is_formed_where_the_old_one_is_slow() {
        let mut reuse = Reuse::new();
        let slow = [1e9, 5e8, 1e8, 1e7, 1e-1];
        assert_eq!(solve(&mut reuse, &slow), (4, 0));
        // What was enough in the last solution is tried again, and given up where it is not.
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
        // It is that of the iterate, and what it gives is looked at like that of a new one.
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
        // One from further away does not.
        reuse.look(0.5, true);
        assert!(reuse.expects_tangent() && !reuse.keeps_tangent());
        reuse.form(false);
        for residual in [0.4, 0.6] {
            reuse.look(residual, true);
            assert!(!reuse.expects_tangent() && reuse.keeps_tangent());
            reuse.keep();
        }
        // Nor where the residual is more than round-off again, or unknowns have changed their
        // meaning.
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
