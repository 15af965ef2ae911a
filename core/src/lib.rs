//! The mechanics of beamsim: slender parts that bend, twist and spin far.
//!
//! A cantilever of length L with bending stiffness EI bends by F L^3 / 3 EI under a small force F at its tip:
//!
//! ```
//! use beamsim_core::model::{ModelBuilder, SectionMatrices, StraightBeam};
//! use beamsim_core::run::{Plan, Run, Snapshot, Stage};
//! use beamsim_core::tensor::Vec3;
//!
//! let (length, bending, force) = (2.0, 10.0, 1e-4);
//! let mut builder = ModelBuilder::new();
//! let root = builder.node("root", Vec3([0.0, 0.0, 0.0]));
//! let tip = builder.node("tip", Vec3([length, 0.0, 0.0]));
//! builder.beam(StraightBeam {
//!     ends: [root, tip],
//!     // EA, GA2, GA3, GJ, EI2, EI3
//!     section: SectionMatrices::diagonal([1e8, 1e8, 1e8, bending, bending, bending]),
//!     axis3: Vec3([0.0, 0.0, 1.0]),
//!     elements: 4,
//!     order: 3,
//! })?;
//! builder.clamp(root)?;
//! builder.force(tip, Vec3([0.0, 0.0, force]))?;
//! let slots = builder.slots(tip)?;
//!
//! let plan = Plan::new(builder.build()?, vec![Stage::statics(1)]);
//! let mut deflection = 0.0;
//! let mut watch = |at: &Snapshot| {
//!     let [_, _, z] = at.state.q[slots.u as usize].0;
//!     deflection = z;
//!     Ok(())
//! };
//! Run::new(plan, &mut watch).finish().0?;
//! let exact = force * length.powi(3) / (3.0 * bending);
//! assert!((deflection / exact - 1.0).abs() < 1e-5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The modules stand in the order of their layers: each imports only those above it.

// Whoever adds a variant to an enum is shown by the compiler where it matters.
#![warn(clippy::wildcard_enum_match_arm)]

pub mod failure;
pub mod warning;

pub mod interrupt;

pub mod threads;

pub mod sorting;

pub mod scalar;
pub mod tensor;

pub mod rotation;

pub mod kernel;

pub mod system;

pub mod effect;

pub mod model;

pub mod integrate;

pub mod solve;

pub mod section;

pub mod run;

pub mod probe;
