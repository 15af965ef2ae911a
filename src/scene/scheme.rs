//! Time schemes of dynamic stages.

use crate::deck::SchemeWord;
use beamsim_core::integrate::Scheme;

/// The time scheme of a word with its coefficients.
pub(super) fn coefficients(scheme: SchemeWord) -> Scheme {
    match scheme {
        SchemeWord::Newmark(beta, gamma) => Scheme::newmark(beta, gamma),
        SchemeWord::Hht(alpha) => Scheme::hht(alpha),
        SchemeWord::GeneralizedAlpha(rho) => Scheme::generalized_alpha(rho),
        SchemeWord::LieGeneralizedAlpha(rho) => Scheme::lie_generalized_alpha(rho),
        SchemeWord::Lobatto => Scheme::lobatto(),
    }
}
