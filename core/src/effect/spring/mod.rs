//! Springs and dampers: from nodes to ground, and between nodes, including cables.

mod ground;
mod link;

pub use ground::{GroundSpring, GroundSprings, rotational};
pub use link::{Link, Links, Pull};
