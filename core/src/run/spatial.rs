//! Looks out of the plane: a stage that is treated in a plane, as it is in space.

use super::failure::Failure;
use super::stage_run::StageRun;
use crate::kernel::Weights;
use crate::model::Assembly;
use crate::solve::{LinearSolver, Tangent, mechanism};
use crate::warning::WarningKind;

/// A stage in space, which is treated in a plane.
pub(super) struct InSpace {
    pub(super) assembly: Assembly,
    pub(super) solver: LinearSolver,
}

impl InSpace {
    fn new(stage: &StageRun) -> Result<Self, Failure> {
        let context = stage.stage().context(stage.number);
        let dof_map = stage.schedule.dof_map(stage.model, None).map_err(|error| stage.describe(error))?;
        let assembly = Assembly::about(stage.state, &context, dof_map, stage.model);
        let (solver, system) = (&stage.newton.solver, &stage.assembly.system);
        match LinearSolver::beside(solver, system, &assembly.system, &stage.model.kinds, stage.model.length) {
            Some(solver) => Ok(Self { assembly, solver }),
            None => Err(stage.moment().limit("not enough memory for the out-of-plane stability check")),
        }
    }
}

/// The look out of the plane, which a stage in space does not need. What it takes is set up by the
/// first look, and where other beams have come near each other.
#[derive(Default)]
pub(super) struct SpatialLook {
    in_space: Option<InSpace>,
}

impl SpatialLook {
    /// The stage in space; `None` where it is treated there anyway.
    pub fn of(&mut self, stage: &StageRun) -> Result<Option<&mut InSpace>, Failure> {
        let is_known = self.in_space.as_ref().is_some_and(|in_space| in_space.assembly.fits(stage.state));
        if !is_known && stage.plane.is_some() {
            self.in_space = Some(InSpace::new(stage)?);
        }
        Ok(self.in_space.as_mut())
    }

    /// Warns where the state is unstable in space by more than the `negative` pivots that it has in
    /// its plane.
    pub fn warn_of_instability(&mut self, stage: &mut StageRun, negative: Option<usize>) -> Result<(), Failure> {
        let Some(in_plane) = negative else { return Ok(()) };
        if stage.issued.unstable == Some(stage.number) {
            return Ok(());
        }
        if let Some(more @ 1..) = self.count(stage, in_plane)? {
            stage.warn_out_of_plane(more);
        }
        Ok(())
    }

    /// How many more pivots are negative in space than the `in_plane` ones of a stage that is
    /// treated in a plane; none where it is treated in space, `None` where it is not known.
    pub fn count(&mut self, stage: &mut StageRun, in_plane: usize) -> Result<Option<usize>, Failure> {
        let Some(InSpace { assembly, solver }) = self.of(stage)? else { return Ok(Some(0)) };
        assembly.evaluate(stage.state, Weights::STIFFNESS, None);
        stage.counters.work.factorisations += 1;
        let mut tangent = Tangent::that_may_go(assembly, stage.state, Weights::STIFFNESS);
        let in_space = solver.negative_pivots(&mut tangent);
        Ok(in_space.and_then(|in_space| in_space.checked_sub(in_plane)))
    }

    /// Refuses what nothing holds in the plane or out of it, with these weights of stiffness,
    /// damping and mass and without velocities.
    pub fn refuse_loose(&mut self, stage: &mut StageRun, weights: Weights) -> Result<(), Failure> {
        let Some(InSpace { assembly, solver }) = self.of(stage)? else { return Ok(()) };
        let still = stage.state.at_rest();
        assembly.evaluate(&still, weights, None);
        stage.counters.work.factorisations += 1;
        let loose = mechanism(solver, &mut Tangent::that_may_go(assembly, &still, weights), stage.model);
        loose.map_or(Ok(()), |vector| Err(stage.name_mechanism(Some(vector), &assembly.system)))
    }
}

impl StageRun<'_> {
    /// A planar scene that a stage does not find in its plane.
    pub fn warn_of_space(&mut self) {
        let planar = self.model.plane.is_some() && self.stage().work.kind().advances_state();
        if planar && self.plane.is_none() {
            let stage = self.number + 1;
            let message =
                format!("stage {stage} is simulated in 3D: its initial state is not exactly in the plane of the scene");
            self.warn(WarningKind::SimulatedInSpace, message);
        }
    }

    /// The plane would be left.
    pub fn warn_out_of_plane(&mut self, count: usize) {
        self.issued.unstable = Some(self.number);
        let at = self.moment();
        let message = format!(
            "unstable out of plane ({at}): {count} more negative pivot(s) in 3D than in the plane in which the scene \
             is simulated; to see the motion out of the plane, add a small load or imperfection in that direction"
        );
        self.warn(WarningKind::UnstableOutOfPlane, message);
    }
}
