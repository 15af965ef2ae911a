//! The plan of a run: the scene, and the stages in their order.

use super::ringing::WatchedColumns;
use super::snapshot::Snapshot;
use crate::integrate::Scheme;
use crate::model::{Model, StageContext, StageKind};
use crate::rotation::Rotation;
use crate::system::{Node, State};
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The scene and its stages.
#[derive(Clone)]
pub struct Plan {
    /// The scene
    pub model: Arc<Model>,
    /// Velocities at the start of the first dynamic stage
    pub initial: Vec<InitialMotion>,
    /// The stages in their order
    pub stages: Vec<Stage>,
    /// Rows of dynamic stages are wanted at multiples of this time.
    pub interval: Option<f64>,
    /// The energy account is asked for.
    pub energy: bool,
    /// The columns that are written and depend on accelerations
    pub watched: Vec<WatchedColumns>,
    /// Somebody looks at continued rotation vectors.
    pub continued: bool,
    /// The initial places of all nodes, where a modal stage asks for them
    pub places: Vec<(Node, Vec3)>,
}

impl Plan {
    /// These stages of a model that begins at rest.
    pub fn new(model: Model, stages: Vec<Stage>) -> Self {
        Self {
            model: Arc::new(model),
            initial: Vec::new(),
            stages,
            interval: None,
            energy: false,
            watched: Vec::new(),
            continued: false,
            places: Vec::new(),
        }
    }
}

/// Velocities given to nodes: velocity + spin x (place - about).
#[derive(Clone, Debug)]
pub struct InitialMotion {
    /// The nodes with their initial places
    pub nodes: Vec<(Node, Vec3)>,
    /// Velocity
    pub velocity: Vec3,
    /// Spatial angular velocity
    pub spin: Vec3,
    /// The point it turns about
    pub about: Vec3,
}

impl InitialMotion {
    /// Gives a state these velocities: v = velocity + spin x (x - about), and the rate of P from
    /// the spin, Pd = T^-T w.
    pub(super) fn give_to(&self, state: &mut State) {
        for &(node, place) in &self.nodes {
            let (u, p) = (node.u as usize, node.p as usize);
            let x = place + state.q[u];
            state.v[u] = self.velocity + self.spin.cross(x - self.about);
            state.v[p] = Rotation::new(state.q[p]).t_inverse().transpose_mul(self.spin);
        }
    }
}

/// One stage.
#[derive(Clone)]
pub struct Stage {
    /// The analysis
    pub work: StageWork,
    /// Newton's tolerance
    pub tolerance: f64,
    /// Newton's limit
    pub max_iterations: usize,
    /// Ends the stage early
    pub until: Option<Until>,
    /// It is seen from a rotating frame.
    pub rotating: bool,
}

/// The part of the largest energies so far by which the total may grow, in dynamic stages that name none
const ENERGY_LIMIT: f64 = 0.2;

impl Stage {
    /// A stage seen from a frame at rest, with the usual tolerance.
    pub fn new(work: StageWork) -> Self {
        Self {
            work,
            tolerance: StageKind::TOLERANCE,
            max_iterations: StageKind::MAX_ITERATIONS,
            until: None,
            rotating: false,
        }
    }

    /// So many equal load levels, with smaller steps where one is not reached at once.
    pub fn statics(steps: usize) -> Self {
        Self::new(StageWork::Static { steps, approach: Approach::Parts })
    }

    /// Equal time steps to a time on the run's clock.
    pub fn dynamics(end: f64, step: f64, scheme: Scheme) -> Self {
        Self::new(StageWork::Dynamic(TimeStepping { end, step, scheme, adaptive: None, energy_limit: ENERGY_LIMIT }))
    }

    /// As effects see it, at this place among the stages.
    pub fn context(&self, number: usize) -> StageContext {
        StageContext { number, kind: self.work.kind(), rotating: self.rotating }
    }
}

/// The analysis of a stage, with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StageWork {
    /// Equal load levels
    Static {
        /// Their number
        steps: usize,
        /// The means where one is not reached at once
        approach: Approach,
    },
    /// A path that may pass limit points
    Path {
        /// The first increment is that of one of so many load levels
        steps: usize,
        /// Most increments
        max_steps: usize,
    },
    /// Small motions
    Modal {
        /// How many modes
        modes: usize,
    },
    /// Critical loads
    Buckling {
        /// How many
        modes: usize,
    },
    /// Time steps
    Dynamic(TimeStepping),
}

/// The settings of time steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeStepping {
    /// Time on the run's clock at which they end
    pub end: f64,
    /// The time step, or the first one
    pub step: f64,
    /// The scheme
    pub scheme: Scheme,
    /// Tolerance of the errors of all steps, where they adapt to it
    pub adaptive: Option<f64>,
    /// The part of the largest energies so far by which the total may grow
    pub energy_limit: f64,
}

/// Newton iterations that a load level, a time step, a mode and a critical load usually take.
const ITERATIONS_OF_A_LEVEL: f64 = 6.0;
const ITERATIONS_OF_A_STEP: f64 = 3.0;
const ITERATIONS_OF_A_MODE: f64 = 10.0;
const ITERATIONS_OF_A_CRITICAL_LOAD: f64 = 60.0;

impl StageWork {
    /// Its kind, as loads, motions and effects see it.
    pub fn kind(&self) -> StageKind {
        match self {
            Self::Static { .. } | Self::Path { .. } => StageKind::Static,
            Self::Modal { .. } => StageKind::Modal,
            Self::Buckling { .. } => StageKind::Buckling,
            Self::Dynamic(_) => StageKind::Dynamic,
        }
    }

    /// The load levels that it is divided into, or whose length its first increment has.
    pub fn load_levels(&self) -> Option<usize> {
        match *self {
            Self::Static { steps, .. } | Self::Path { steps, .. } => Some(steps),
            Self::Modal { .. } | Self::Buckling { .. } | Self::Dynamic(_) => None,
        }
    }

    /// How it approaches load levels.
    pub fn approach(&self) -> Option<Approach> {
        match *self {
            Self::Static { approach, .. } => Some(approach),
            Self::Path { .. } | Self::Modal { .. } | Self::Buckling { .. } | Self::Dynamic(_) => None,
        }
    }

    /// Its time scheme.
    pub fn scheme(&self) -> Option<Scheme> {
        match *self {
            Self::Dynamic(steps) => Some(steps.scheme),
            Self::Static { .. } | Self::Path { .. } | Self::Modal { .. } | Self::Buckling { .. } => None,
        }
    }

    /// The time on the run's clock at which it ends.
    pub fn end(&self) -> Option<f64> {
        match *self {
            Self::Dynamic(steps) => Some(steps.end),
            Self::Static { .. } | Self::Path { .. } | Self::Modal { .. } | Self::Buckling { .. } => None,
        }
    }

    /// Follows an equilibrium path in the load factor, so that a load or a motion must grow with
    /// it.
    pub fn follows_path(&self) -> bool {
        match self {
            Self::Path { .. } | Self::Buckling { .. } => true,
            Self::Static { .. } | Self::Modal { .. } | Self::Dynamic(_) => false,
        }
    }

    /// Its progress is slow at first and fast at the end: a search that closes in.
    pub fn speeds_up(&self) -> bool {
        match self {
            Self::Buckling { .. } => true,
            Self::Static { .. } | Self::Path { .. } | Self::Modal { .. } | Self::Dynamic(_) => false,
        }
    }

    /// Newton iterations that it usually takes, where the clock stands at `start` before it.
    pub fn usual_iterations(&self, start: f64) -> f64 {
        match *self {
            Self::Static { steps, .. } => steps as f64 * ITERATIONS_OF_A_LEVEL,
            Self::Path { max_steps, .. } => max_steps as f64 * ITERATIONS_OF_A_LEVEL,
            Self::Dynamic(steps) => (steps.end - start) / steps.step * ITERATIONS_OF_A_STEP,
            Self::Modal { modes } => modes as f64 * ITERATIONS_OF_A_MODE,
            Self::Buckling { modes } => modes as f64 * ITERATIONS_OF_A_CRITICAL_LOAD,
        }
    }

    /// The names of the numbers that it finds beside its rows, such as `mode1.omega`.
    pub fn results(&self) -> Vec<String> {
        let mode = |mode: usize| ["omega", "growth"].map(|quantity| format!("mode{mode}.{quantity}"));
        match *self {
            Self::Modal { modes } => (1..=modes).flat_map(mode).collect(),
            Self::Buckling { modes } => (1..=modes).map(|mode| format!("buckling{mode}.load")).collect(),
            Self::Static { .. } | Self::Path { .. } | Self::Dynamic(_) => Vec::new(),
        }
    }
}

/// The means of a stage where Newton does not reach a level at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum Approach {
    /// Nothing
    Straight,
    /// Smaller steps
    Parts,
    /// Smaller steps, then arc length along the path; only where everything is linear in the load
    /// factor
    Path,
}

/// A condition that ends a stage at the first row beyond it.
#[derive(Clone)]
pub struct Until {
    /// The watched column
    pub column: Arc<dyn Fn(&Snapshot) -> f64 + Send + Sync>,
    /// Ends below this
    pub below: Option<f64>,
    /// Ends above this
    pub above: Option<f64>,
}
