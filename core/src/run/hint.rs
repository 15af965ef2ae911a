//! Hints after a failure: cures that the plan does not have already.

use super::failure::{Attempts, Failure, Moment};
use super::plan::{Approach, Plan, Stage};
use crate::effect::contact;
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
            Self::SurfaceTurnsTooFar { .. } => Some("take more `steps`, or a smaller `step`".into()),
            Self::LimitPoint { at, .. } => Some(has(at)?.hint_of_limit()),
            Self::StepTooSmall { at, .. } => {
                let cures = [
                    has(at)?.damping(),
                    Some("use fixed steps".into()),
                    Some("allow a larger `step_tolerance`".into()),
                ];
                Some(format!("accelerations oscillate there from step to step: {}", any_of(cures)))
            }
            Self::Singular { place: Some(place), .. } if place.is_joint() => Some(
                "a support, another joint or a closed loop of rigid parts already constrains this motion: release one \
                 constraint, for example by a spherical joint in place of a revolute one"
                    .into(),
            ),
            Self::Singular { at, .. } => Some(has(at)?.hint_of_mechanism()),
            Self::Penetration { .. } => {
                Some("take more `steps`, a larger `penetration`, or a larger `stiffness` of the contact".into())
            }
            Self::ContactStart { .. } => Some(
                "move the surface or the beam apart (the radius of the contact counts), or allow a larger `penetration`; \
                 a beam with nodes on a curved surface is inside of it between them (more `elements`, an arc); a surface \
                 that is to hold the beam within it takes `side = \"inside\"`"
                    .into(),
            ),
            Self::SliderEnd { .. } => Some(
                "end the stage before (`until`), make the beam longer, or stop the node by a spring".into(),
            ),
            Self::ContactPassed { .. } | Self::NonFinite { effect: Some(contact::NAME), .. } => {
                Some("give the contact a larger `stiffness`, or take more `steps` or a smaller `step`".into())
            }
            Self::MeshTooCoarse { .. } => Some("use more `elements` there".into()),
            Self::EnergyGrowth { at, .. } => {
                let cures = [has(at)?.damping(), Some("take a smaller `step`".into())];
                let cures = any_of(cures);
                Some(format!(
                    "the time step does not resolve the motion: {cures}; if the growth is intended, raise \
                     `energy_limit`"
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
            return "round-off hides the stiffness of the softest mode (see the warning): use fewer elements of a \
                    higher order"
                .into();
        }
        let mesh = self.has_beams().then(|| "more `elements` where the curvature is largest".to_string());
        let work = &self.stage.work;
        if work.kind().advances_time() {
            let cures = [self.damping(), Some("take a smaller `step`".into()), mesh.map(|mesh| format!("use {mesh}"))];
            return format!("smaller steps were tried: {}", any_of(cures));
        }
        if tried.touches {
            return self.hint_of_contact(tried);
        }
        if work.load_levels().is_some() && work.follows_path() {
            return "shorter increments were tried: the mesh may be too coarse where the curvature is largest, or a \
                    branch may cross the path (a small lateral force selects one)"
                .into();
        }
        match work.approach() {
            Some(Approach::Straight) => {
                let cures = [
                    Some("remove `adaptive = false`, so that the stage takes smaller load levels".into()),
                    self.levels(),
                ];
                any_of(cures)
            }
            Some(Approach::Parts) => {
                let (what, stages) = match (self.stage.rotating, tried.may_touch) {
                    (true, _) => ("`frame`", ""),
                    (false, true) => ("contact", ""),
                    (false, false) => {
                        ("`history`", " (load and unload in separate stages, with `stages = [1]` in a load)")
                    }
                };
                let cures = any_of([self.levels(), self.fall()]);
                format!(
                    "smaller load levels were tried: there may be a limit point just ahead; only arc length passes it, \
                     and arc length does not support {what}{stages}; otherwise {cures}"
                )
            }
            Some(Approach::Path) | None => {
                let mesh = mesh.map(|mesh| format!("use {mesh}"));
                let cures =
                    any_of([self.levels(), mesh, Some("select a branch by a small lateral force".into()), self.fall()]);
                format!("smaller load levels and arc length were tried: {cures}")
            }
        }
    }

    /// A cure where contacts touch and a load level fails.
    fn hint_of_contact(&self, tried: &Attempts) -> String {
        let cures = any_of([
            Some("prescribe its motion in place of the load".to_string()),
            self.fall().map(|_| "let it slide in a dynamic stage".to_string()),
        ]);
        let others = any_of([
            self.levels(),
            Some("use a smaller `stiffness` of the contact".into()),
            match tried.beams_touch && tried.curved {
                true => Some(
                    "use more `elements` near the contact (of `order = 1` where beams wrap around each other)".into(),
                ),
                false => self.has_beams().then(|| "use more `elements` near the contact".into()),
            },
        ]);
        format!(
            "smaller load levels and softer contacts were tried: a part that slides under a load which friction cannot \
             hold has no balance ({cures}); otherwise {others}{}",
            if tried.beams_touch {
                "; beams side by side that are pressed together need room at their ends, and slide off each other \
                 without friction"
            } else {
                ""
            }
        )
    }

    fn hint_of_turns(&self) -> String {
        if self.stage.work.kind().advances_time() {
            let else_damp = self.damping().map_or(String::new(), |damping| format!(": {damping}"));
            format!(
                "use smaller steps; if nothing should rotate this fast, the step does not resolve the \
                 vibration{else_damp}"
            )
        } else if self.stage.work.approach() == Some(Approach::Straight) {
            "use smaller steps: remove `adaptive = false`, or increase `steps`".into()
        } else {
            "use smaller steps: increase `steps`".into()
        }
    }

    fn hint_of_limit(&self) -> String {
        let cures = any_of([
            self.levels().map(|levels| format!("{levels}, which may follow another branch")),
            Some("reduce the load".into()),
            Some("prescribe a displacement in place of the load".into()),
            self.fall(),
        ]);
        format!(
            "this branch of the equilibrium path does not reach the load (the rows follow it past its limit points): \
             {cures}"
        )
    }

    fn hint_of_mechanism(&self) -> String {
        let hold = "add a support, a spring or a joint that constrains this direction";
        let work = &self.stage.work;
        if work.kind().needs_inertia() {
            format!("{hold}, or give it inertia (`rhoA`, `rhoJ`, `mass` or `inertia`)")
        } else if work.follows_path() {
            format!(
                "{hold}; if only loads hold the structure (such as a hanging chain), put a static stage with load \
                 levels before this one, which finds the state of rest"
            )
        } else if self.plan.model.linear || work.approach() == Some(Approach::Straight) {
            hold.into()
        } else {
            let levels = self.levels().filter(|_| self.stage.rotating);
            let levels = levels.map_or(String::new(), |levels| {
                format!("; where one level takes the frame past a critical speed, {levels}")
            });
            format!("{hold}: the loads do not stabilise it either{levels}")
        }
    }

    fn has_beams(&self) -> bool {
        self.plan.model.elements > 0
    }

    /// More load levels, where they are not many already.
    fn levels(&self) -> Option<String> {
        let steps = self.stage.work.load_levels()?;
        (steps < MANY_LEVELS).then(|| format!("use more than {steps} `steps`"))
    }

    /// A damped motion to where it comes to rest, where none comes before.
    fn fall(&self) -> Option<String> {
        let words = "let it settle in a dynamic stage with `[damping]`, followed by a static stage";
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
        Some(format!("damp unresolved vibrations ({cure})"))
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
