//! The plan of a run: the scene, and the stages in their order.

use super::levels::Approach;
use super::observer::Snapshot;
use crate::integrate::Scheme;
use crate::model::{Model, StageContext, StageKind};
use crate::system::Node;
use crate::tensor::Vec3;
use std::sync::Arc;

/// What is to be done.
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
    /// Whether the energy account is asked for
    pub energy: bool,
    /// Whether somebody looks at continued rotation vectors
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

/// One stage.
#[derive(Clone)]
pub struct Stage {
    /// What is done
    pub work: StageWork,
    /// Newton's tolerance
    pub tolerance: f64,
    /// Newton's limit
    pub max_iterations: usize,
    /// Ends the stage early
    pub until: Option<Until>,
    /// Whether it is seen from a rotating frame
    pub rotating: bool,
}

/// The tolerance of stages that name none: the part of the largest forces that may be out of balance.
const TOLERANCE: f64 = 1e-9;

/// The limit of Newton's iterations of stages that name none
const MAX_ITERATIONS: usize = 25;

/// The part of the largest energies so far by which the total may grow, in dynamic stages that name none
const ENERGY_LIMIT: f64 = 0.2;

impl Stage {
    /// A stage seen from a frame at rest, with the usual tolerance.
    pub fn new(work: StageWork) -> Self {
        Self { work, tolerance: TOLERANCE, max_iterations: MAX_ITERATIONS, until: None, rotating: false }
    }

    /// So many equal load levels, with smaller steps where one is not reached at once.
    pub fn statics(steps: usize) -> Self {
        Self::new(StageWork::Static { steps, approach: Approach::Parts })
    }

    /// Equal time steps to a time on the run's clock.
    pub fn dynamics(end: f64, step: f64, scheme: Scheme) -> Self {
        Self::new(StageWork::Dynamic { end, step, scheme, adaptive: None, energy_limit: ENERGY_LIMIT })
    }

    /// As effects see it, at this place among the stages.
    pub fn context(&self, number: usize) -> StageContext {
        StageContext { number, kind: self.work.kind(), rotating: self.rotating }
    }
}

/// What a stage does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StageWork {
    /// Equal load levels
    Static {
        /// Their number
        steps: usize,
        /// What it may do where one is not reached at once
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
    Dynamic {
        /// Time on the run's clock at which it ends
        end: f64,
        /// Step, or the first one
        step: f64,
        /// The method
        scheme: Scheme,
        /// Tolerance of the errors of all steps, where they adapt to it
        adaptive: Option<f64>,
        /// The part of the largest energies so far by which the total may grow
        energy_limit: f64,
    },
}

impl StageWork {
    /// Its kind.
    pub fn kind(&self) -> StageKind {
        match self {
            Self::Static { .. } | Self::Path { .. } => StageKind::Static,
            Self::Modal { .. } => StageKind::Modal,
            Self::Buckling { .. } => StageKind::Buckling,
            Self::Dynamic { .. } => StageKind::Dynamic,
        }
    }
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
