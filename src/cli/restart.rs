//! `run --checkpoint`, `--resume`, `--fresh`: runs that go on where they were stopped.

use super::console;
use super::error::CommandError;
use super::simulate::Target;
use crate::output::{FoundCheckpoint, ResultFolder};
use crate::scene::Scene;
use std::time::Duration;

/// The time between checkpoints.
const INTERVAL: Duration = Duration::from_secs(60);

/// Arguments about checkpoints.
#[derive(clap::Args)]
pub struct RestartArguments {
    /// Time between checkpoints, from which a run that was stopped can be resumed: 10s, 5m, 1h
    /// (default: 60s)
    #[arg(long, value_parser = console::duration, value_name = "TIME")]
    checkpoint: Option<Duration>,
    /// Go on from the last checkpoint of a run that was stopped. `end`, `until`, the rows that are
    /// written and the number of threads may differ from before
    #[arg(long, conflicts_with = "fresh")]
    resume: bool,
    /// Begin anew, and drop the checkpoint of a run that was stopped
    #[arg(long)]
    fresh: bool,
}

impl RestartArguments {
    /// The target of a run: at its beginning, or at its last checkpoint.
    pub fn target(&self, name: &str, folder: ResultFolder, scene: &Scene) -> Result<Target, CommandError> {
        let interval = Some(self.checkpoint.unwrap_or(INTERVAL));
        if self.fresh {
            return Ok(Target { folder, saved: None, interval });
        }
        let place = folder.path().display().to_string();
        let refuse = |why: String| Err(CommandError::Checkpoint(why));
        match FoundCheckpoint::read(scene, folder.path())? {
            FoundCheckpoint::Nothing => {
                if self.resume {
                    console::note(&format!("{name}: {place} has no checkpoint: the run begins at its start"));
                }
                Ok(Target { folder, saved: None, interval })
            }
            FoundCheckpoint::Own(saved) if self.resume => {
                let time = saved.run.time();
                if let Some(end) = scene.plan.stages[saved.run.stage()].work.end().filter(|&end| end < time) {
                    return refuse(format!(
                        "the run in {place} is at time {time} already, behind `end` = {end} of its stage: resume it \
                         with a later end, or add --fresh to begin anew"
                    ));
                }
                console::note(&format!("{name}: goes on after {} steps and levels", saved.run.steps()));
                Ok(Target { folder, saved: Some(saved), interval })
            }
            FoundCheckpoint::Own(_) => refuse(format!(
                "{place} has the checkpoint of a run of this deck that was stopped: add --resume to go on with it, or \
                 --fresh to begin anew"
            )),
            FoundCheckpoint::Other(why) => refuse(format!(
                "{place} has the checkpoint of a run that was stopped, but {why}: add --fresh to drop it and begin \
                 anew, or give another folder with --out"
            )),
        }
    }

    /// Refuses to begin a long search before a run that would not begin.
    pub fn refuse_early(&self, folder: &ResultFolder) -> Result<(), CommandError> {
        if self.resume || self.fresh { Ok(()) } else { refuse_checkpoint(folder, "--resume, or --fresh to begin anew") }
    }
}

/// Refuses a folder with the checkpoint of a run that was stopped; `way` says how to go on.
pub fn refuse_checkpoint(folder: &ResultFolder, way: &str) -> Result<(), CommandError> {
    if !folder.has_checkpoint() {
        return Ok(());
    }
    let place = folder.path().display();
    Err(CommandError::Checkpoint(format!(
        "{place} has the checkpoint of a run that was stopped, which would be lost: continue it with `beamsim run` and \
         {way}, or give another folder with --out"
    )))
}
