//! Hints after a failure: cures that the plan does not have already.

use super::failure::{Attempts, Failure, Moment};
use super::plan::{Approach, Plan, Stage};
use crate::integrate::Scheme;
use crate::system::Category;

/// Load levels beyond which more of them are no advice.
const MANY_LEVELS: usize = 1000;

impl Failure {
    /// A cure, in the plan that ended with it.
    pub fn hint(&self, plan: &Plan) -> Option<String> {
        let has = |at: &Moment| Has::new(plan, at.stage);
        match self {
            Self::NotConverged { at, tried, .. } => Some(has(at)?.hint_of_balance(tried)),
            Self::TurnsTooFar { at, .. } => Some(has(at)?.hint_of_turns()),
            Self::LimitPoint { at, .. } => Some(has(at)?.hint_of_limit()),
            Self::StepTooSmall { at, .. } => {
                let cures = [has(at)?.damping(), Some("take fixed steps".into()), Some("allow a larger `step_tolerance`".into())];
                Some(format!("accelerations jump there from step to step: {}", any_of(cures)))
            }
            Self::Singular { place: Some(place), .. } if place.is_joint() => Some(
                "a support, another joint or a loop of rigid parts holds the same already: release one of them, for example by a \
                 spherical joint in place of a revolute one"
                    .into(),
            ),
            Self::Singular { at, .. } => Some(has(at)?.hint_of_mechanism()),
            Self::MeshTooCoarse { .. } => Some("use more `elements` there".into()),
            Self::EnergyGrowth { at, .. } => {
                let cures = [has(at)?.damping(), Some("take a smaller `step`".into())];
                let cures = any_of(cures);
                Some(format!(
                    "the time step does not resolve the motion: {cures}; where the growth is meant, raise `energy_limit`"
                ))
            }
            Self::NonFinite { .. } => {
                Some("look for values near the limits of floating-point numbers in the deck".into())
            }
            Self::Deck(_) | Self::Limit(_) | Self::Io(_) | Self::Interrupted { .. } => None,
        }
    }
}

/// A stage of a plan, and the cures that it has already.
struct Has<'a> {
    plan: &'a Plan,
    stage: &'a Stage,
    /// The stages before it
    before: &'a [Stage],
}

impl<'a> Has<'a> {
    /// `number` from 1
    fn new(plan: &'a Plan, number: usize) -> Option<Self> {
        let before = plan.stages.get(..number.checked_sub(1)?)?;
        Some(Self { plan, stage: plan.stages.get(number - 1)?, before })
    }

    fn hint_of_balance(&self, tried: &Attempts) -> String {
        if tried.soft {
            return "round-off takes the stiffness of the softest motion (see the warning): use fewer elements of a higher order".into();
        }
        let mesh = self.has_beams().then(|| "more `elements` where it turns most".to_string());
        let work = &self.stage.work;
        if work.kind().advances_time() {
            let cures = [self.damping(), Some("take a smaller `step`".into()), mesh.map(|mesh| format!("use {mesh}"))];
            return format!("smaller steps were tried: {}", any_of(cures));
        }
        if work.load_levels().is_some() && work.follows_path() {
            return "shorter increments were tried: the mesh may be too coarse where it turns most, or a branch cross the path (a small side \
                    force chooses one)"
                .into();
        }
        match work.approach() {
            Some(Approach::Straight) => {
                let cures = [
                    Some("leave `adaptive = false` out, so that the stage takes smaller levels".into()),
                    self.levels(),
                ];
                any_of(cures)
            }
            Some(Approach::Parts) => {
                let what = if self.stage.rotating { "`frame`" } else { "`history`" };
                let stages = match self.stage.rotating {
                    true => "",
                    false => " (load and unload in stages of their own, with `stages = [1]` in a load)",
                };
                let cures = any_of([self.levels(), self.fall()]);
                format!(
                    "smaller load levels were tried: a limit load may lie just ahead, around which only arc length leads, and that follows no \
                     {what}{stages}; else {cures}"
                )
            }
            Some(Approach::Path) | None => {
                let mesh = mesh.map(|mesh| format!("use {mesh}"));
                let cures =
                    any_of([self.levels(), mesh, Some("choose a branch by a small side force".into()), self.fall()]);
                format!("smaller load levels and arc length were tried: {cures}")
            }
        }
    }

    fn hint_of_turns(&self) -> String {
        if self.stage.work.kind().advances_time() {
            let else_damp = self.damping().map_or(String::new(), |damping| format!(": {damping}"));
            format!(
                "use smaller steps; in a stage in which nothing should turn so fast the step does not resolve the motion{else_damp}"
            )
        } else if self.stage.work.approach() == Some(Approach::Straight) {
            "use smaller steps: leave `adaptive = false` out, or take more `steps`".into()
        } else {
            "use smaller steps: more `steps`".into()
        }
    }

    fn hint_of_limit(&self) -> String {
        let cures = any_of([
            self.levels().map(|levels| format!("{levels}, which may keep it on another")),
            Some("load it less".into()),
            Some("prescribe a motion in place of the load".into()),
            self.fall(),
        ]);
        format!("the path it is on does not come to this load (the rows follow it beyond its limit points): {cures}")
    }

    fn hint_of_mechanism(&self) -> String {
        let hold = "add a support, a spring or a joint that holds this direction";
        let work = &self.stage.work;
        if work.kind().needs_inertia() {
            format!("{hold}, or give it mass")
        } else if work.follows_path() {
            format!("{hold}; what its loads hold comes to rest in a static stage with load levels, before this one")
        } else if self.plan.model.linear || work.approach() == Some(Approach::Straight) {
            hold.into()
        } else {
            format!("{hold}: its loads do not, either")
        }
    }

    fn has_beams(&self) -> bool {
        self.plan.model.elements > 0
    }

    /// More load levels, where they are not many already.
    fn levels(&self) -> Option<String> {
        let steps = self.stage.work.load_levels()?;
        (steps < MANY_LEVELS).then(|| format!("take more `steps` than {steps}"))
    }

    /// A damped motion to where it comes to rest, where none comes before.
    fn fall(&self) -> Option<String> {
        let words = "let it fall in a dynamic stage with `[damping]`, and find its balance in a static stage behind it";
        (!self.falls_before()).then(|| words.into())
    }

    fn falls_before(&self) -> bool {
        let damped = self.plan.model.effects.iter().any(|e| e.category() == Category::Damping || e.damps());
        damped && self.before.iter().any(|stage| stage.work.kind().advances_time())
    }

    /// Damping of what steps do not resolve, where the scheme has not all of it.
    fn damping(&self) -> Option<String> {
        let cure = match SchemeFamily::of(&self.stage.work.scheme()?) {
            SchemeFamily::Newmark => "scheme = \"generalized_alpha\"",
            SchemeFamily::Hht => "scheme = \"generalized_alpha\" with a small `rho_inf`",
            SchemeFamily::GeneralizedAlpha { radius } if radius > 0.0 => "a smaller `rho_inf`",
            SchemeFamily::GeneralizedAlpha { .. } => return None,
        };
        Some(format!("damp what it does not resolve ({cure})"))
    }
}

/// The name of a scheme in a deck.
enum SchemeFamily {
    Newmark,
    Hht,
    GeneralizedAlpha { radius: f64 },
}

impl SchemeFamily {
    fn of(scheme: &Scheme) -> Self {
        match (scheme.alpha_m, scheme.alpha_f) {
            (0.0, 0.0) => Self::Newmark,
            (0.0, _) => Self::Hht,
            (_, alpha_f) => Self::GeneralizedAlpha { radius: alpha_f / (1.0 - alpha_f) },
        }
    }
}

/// "a, b, or c" of those that there are.
fn any_of<const N: usize>(cures: [Option<String>; N]) -> String {
    let mut cures: Vec<String> = cures.into_iter().flatten().collect();
    match cures.pop() {
        None => String::new(),
        Some(last) if cures.is_empty() => last,
        Some(last) => format!("{}, or {last}", cures.join(", ")),
    }
}
