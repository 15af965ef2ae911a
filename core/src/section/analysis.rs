//! A section on meshes that become finer until its estimated error meets an aim.

use super::error::{SectionError, check_nodes};
use super::geometry::Geometry;
use super::grid::REFINEMENT;
use super::material::Material;
use super::mesh::Mesh;
use super::properties::{Properties, energy_difference, load_about_origin, mass_centre, moved, moved_compliance};
use super::saint_venant::{Solution, solve};
use super::stress::NodalStresses;
use super::{Matrix6, Point, Vector6};
use crate::interrupt;
use std::sync::OnceLock;

/// The aimed error of the stiffness where none is given
pub const DEFAULT_AIM: f64 = 1e-3;

/// Estimates above this deserve a warning
pub const POOR_ESTIMATE: f64 = 1e-2;

/// Refinement ends before meshes of more nodes where an aim is given. A laminate of 39,000 nodes takes
/// ten seconds.
const MAX_NODES: usize = 60_000;

/// Refinement ends before meshes of more nodes where no aim is given. A laminate of 18,000 nodes takes
/// two seconds.
const MAX_NODES_UNASKED: usize = 20_000;

/// Order of convergence that estimates count on. Smooth sections converge with order 4, corners
/// between materials with less than 2.
const ASSUMED_ORDER: f64 = 2.0;

/// Order by which the level that meets the aim is predicted
const PREDICTED_ORDER: f64 = 3.5;

/// Levels that are skipped at most
const MAX_JUMP: usize = 4;

/// Highest level of the first mesh
const MAX_FIRST_LEVEL: usize = 4;

/// Nodes up to which the mesh of stresses is made finer than that of the stiffness
const STRESS_NODES: f64 = 3000.0;

/// Levels by which the mesh of stresses is finer, at most: errors of stresses fall to a fifth
const MOST_STRESS_JUMP: usize = 2;

/// The point of a section through which the line of the beam goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reference {
    /// A point in the coordinates of the shape, turned and moved
    Point(Point),
    /// Centre of the area
    Centroid,
    /// The point at which an axial force makes no curvature
    TensionCentre,
    /// The point at which a shear force makes no twist
    ShearCentre,
    /// Centre of mass
    MassCentre,
}

/// A reason to warn of a computed section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SectionWarning {
    /// The estimated error of the stiffness is large
    PoorEstimate {
        /// The estimate, relative
        estimate: f64,
    },
    /// The aim was not met with the largest mesh
    AimNotMet {
        /// The estimate, relative
        estimate: f64,
    },
}

/// A computed section.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The finest mesh
    pub mesh: Mesh,
    /// The solution on it
    pub solution: Solution,
    /// Estimated relative error of the stiffness, in the energy of any strain
    pub estimate: f64,
    /// False if the aim was not met with the largest mesh
    pub meets_aim: bool,
    /// Level of the mesh
    pub level: usize,
    /// The shape, for a mesh of stresses
    geometry: Geometry,
    /// True if a mesh of stresses may be finer than that of the stiffness
    refines_stresses: bool,
    /// Stresses under unit resultants, found when they are asked for
    stresses: OnceLock<Result<StressField, SectionError>>,
}

/// Stresses of a section with the mesh that they belong to.
#[derive(Clone, Debug)]
pub struct StressField {
    /// The mesh, which may be finer than that of the stiffness
    pub mesh: Mesh,
    /// Stresses at its nodes
    pub nodal: NodalStresses,
    /// Why the mesh is that of the stiffness, where it was to be finer
    pub coarse: Option<SectionError>,
}

impl StressField {
    fn new(
        mesh: Mesh,
        materials: &[Material],
        solution: &Solution,
        coarse: Option<SectionError>,
    ) -> Result<Self, SectionError> {
        let nodal = NodalStresses::new(&mesh, materials, solution)?;
        Ok(Self { mesh, nodal, coarse })
    }
}

/// The aim of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeshAim {
    /// The error [`DEFAULT_AIM`], without the largest meshes
    Usual,
    /// Estimated relative error of the stiffness, in the energy of any strain
    Error(f64),
    /// Longest side of an element
    Size(f64),
}

/// A section on one mesh.
struct Computed {
    level: usize,
    mesh: Mesh,
    solution: Solution,
}

impl Computed {
    fn new(geometry: &Geometry, materials: &[Material], level: usize) -> Result<Self, SectionError> {
        if interrupt::is_requested() {
            return Err(SectionError::Interrupted);
        }
        let mesh = geometry.mesh(level)?;
        check_nodes(mesh.nodes.len())?;
        let mut solution = solve(&mesh, materials)?;
        if materials.iter().all(Material::is_isotropic) {
            // A mesh need not be as symmetric as its shape.
            solution.impose_mirrors(geometry.mirrors());
        }
        Ok(Self { level, mesh, solution })
    }

    /// On the coarsest mesh whose curved elements are not folded.
    fn coarsest(geometry: &Geometry, materials: &[Material]) -> Result<Self, SectionError> {
        for level in 0..MAX_FIRST_LEVEL {
            match Self::new(geometry, materials, level) {
                Err(SectionError::InvertedElement { .. }) => {}
                other => return other,
            }
        }
        Self::new(geometry, materials, MAX_FIRST_LEVEL)
    }

    /// The estimated error, from a coarser mesh.
    fn estimate(&self, coarser: &Self) -> f64 {
        let refinement = REFINEMENT.powi((self.level - coarser.level) as i32);
        let [coarse, fine] = [coarser, self].map(|on| moved(&on.solution.stiffness, self.solution.centroid));
        let difference = energy_difference(&coarse, &fine);
        // Without digits nothing is known of it.
        difference.unwrap_or(f64::INFINITY) / (libm::pow(refinement, ASSUMED_ORDER) - 1.0)
    }

    /// The most levels by which a finer mesh has no more than a number of nodes.
    fn possible_jump(&self, max_nodes: usize) -> usize {
        let nodes = |jump: usize| self.mesh.nodes.len() as f64 * REFINEMENT.powi(2 * jump as i32);
        (1..=MAX_JUMP).rev().find(|&jump| nodes(jump) <= max_nodes as f64).unwrap_or(0)
    }

    fn finish(self, geometry: &Geometry, aim: MeshAim, estimate: f64, meets_aim: bool) -> Analysis {
        let Self { mesh, solution, level } = self;
        let refines_stresses = match aim {
            MeshAim::Usual | MeshAim::Error(_) => true,
            MeshAim::Size(_) => false,
        };
        let geometry = geometry.clone();
        Analysis { mesh, solution, estimate, meets_aim, level, geometry, refines_stresses, stresses: OnceLock::new() }
    }
}

/// Computes a section on meshes that become finer until one meets the aim, or the next would be
/// too large. The error is estimated from two meshes.
pub fn analyse(geometry: &Geometry, materials: &[Material], aim: MeshAim) -> Result<Analysis, SectionError> {
    let mut coarser = Computed::coarsest(geometry, materials)?;
    let mut jump = 1;
    loop {
        let finer = Computed::new(geometry, materials, coarser.level + jump)?;
        let estimate = finer.estimate(&coarser);
        let jump_to = |error: f64| libm::log(estimate / error) / (PREDICTED_ORDER * libm::log(REFINEMENT));
        let (wanted_jump, max_nodes) = match aim {
            MeshAim::Usual => (jump_to(DEFAULT_AIM), MAX_NODES_UNASKED),
            MeshAim::Error(error) => (jump_to(error), MAX_NODES),
            MeshAim::Size(size) => (libm::log(finer.mesh.longest_side() / size) / libm::log(REFINEMENT), MAX_NODES),
        };
        if wanted_jump <= 0.0 {
            return Ok(finer.finish(geometry, aim, estimate, true));
        }
        jump = finer.possible_jump(max_nodes).min(wanted_jump.ceil() as usize);
        if jump == 0 {
            return Ok(finer.finish(geometry, aim, estimate, false));
        }
        coarser = finer;
    }
}

impl Analysis {
    /// Centres, torsional stiffness and principal axes.
    pub fn properties(&self) -> Properties {
        Properties::new(&self.solution.compliance)
    }

    /// The place of a reference point.
    pub fn place(&self, reference: Reference) -> Point {
        match reference {
            Reference::Point(at) => at,
            Reference::Centroid => self.solution.centroid,
            Reference::TensionCentre => self.properties().tension_centre,
            Reference::ShearCentre => self.properties().shear_centre,
            Reference::MassCentre => mass_centre(&self.solution.mass),
        }
    }

    /// Stiffness about a point.
    pub fn stiffness_about(&self, at: Point) -> Matrix6 {
        moved(&self.solution.stiffness, at)
    }

    /// Compliance about a point.
    pub fn compliance_about(&self, at: Point) -> Matrix6 {
        moved_compliance(&self.solution.compliance, at)
    }

    /// Mass about a point.
    pub fn mass_about(&self, at: Point) -> Matrix6 {
        moved(&self.solution.mass, at)
    }

    /// The load to give to [`NodalStresses`], from resultants about a point.
    pub fn load_of(&self, resultants: &Vector6, at: Point) -> Vector6 {
        load_about_origin(resultants, at)
    }

    /// Reasons to warn of the section.
    pub fn warnings(&self) -> Vec<SectionWarning> {
        let estimate = self.estimate;
        let mut warnings = Vec::new();
        if estimate > POOR_ESTIMATE {
            warnings.push(SectionWarning::PoorEstimate { estimate });
        } else if !self.meets_aim {
            warnings.push(SectionWarning::AimNotMet { estimate });
        }
        warnings
    }

    /// Stresses under unit resultants, computed once. The materials are those of the analysis.
    ///
    /// Errors of stresses fall with the square of the size of elements, those of the stiffness with
    /// its fourth power: where the mesh of the stiffness is coarse, stresses have a finer one.
    pub fn stresses(&self, materials: &[Material]) -> Result<&StressField, SectionError> {
        let find = || {
            let jump = if self.refines_stresses { self.stress_jump() } else { 0 };
            if jump == 0 {
                return self.coarse_stresses(materials, None);
            }
            let finer = Computed::new(&self.geometry, materials, self.level + jump)
                .and_then(|Computed { mesh, solution, .. }| StressField::new(mesh, materials, &solution, None));
            self.or_coarse(finer, materials)
        };
        self.stresses.get_or_init(find).as_ref().map_err(Clone::clone)
    }

    /// Stresses on a finer mesh; if they cannot be found, those on the mesh of the stiffness.
    fn or_coarse(
        &self,
        finer: Result<StressField, SectionError>,
        materials: &[Material],
    ) -> Result<StressField, SectionError> {
        match finer {
            Ok(field) => Ok(field),
            Err(SectionError::Interrupted) => Err(SectionError::Interrupted),
            Err(error) => self.coarse_stresses(materials, Some(error)),
        }
    }

    /// Stresses on the mesh of the stiffness.
    fn coarse_stresses(
        &self,
        materials: &[Material],
        coarse: Option<SectionError>,
    ) -> Result<StressField, SectionError> {
        StressField::new(self.mesh.clone(), materials, &self.solution, coarse)
    }

    /// Levels by which the mesh of stresses is finer.
    fn stress_jump(&self) -> usize {
        let nodes = |jump: usize| self.mesh.nodes.len() as f64 * REFINEMENT.powi(2 * jump as i32);
        (1..=MOST_STRESS_JUMP).rev().find(|&jump| nodes(jump) <= STRESS_NODES).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::geometry::{Profile, Shape};
    use super::super::mesh::Region;
    use super::*;

    #[test]
    fn stresses_fall_back_to_the_mesh_of_the_stiffness() {
        let profile = Profile::Rectangle { d: 2.0, b: 1.0 };
        let geometry = Geometry::new(Shape::Profile { profile, region: Region::new("block", 0) });
        let materials = [Material::isotropic("steel", 1.0, 0.3, 1.0)];
        let analysis = analyse(&geometry, &materials, MeshAim::Error(DEFAULT_AIM)).expect("a section");
        let error = SectionError::EmptyRegion { region: "block".into() };
        let field = analysis.or_coarse(Err(error.clone()), &materials).expect("stresses");
        assert_eq!(field.coarse, Some(error));
        assert_eq!(field.mesh.nodes.len(), analysis.mesh.nodes.len());
        let finer = analysis.stresses(&materials).expect("stresses");
        assert_eq!(finer.coarse, None);
        assert!(finer.mesh.nodes.len() > field.mesh.nodes.len());
        let stopped = analysis.or_coarse(Err(SectionError::Interrupted), &materials);
        assert_eq!(stopped.map(|_| ()), Err(SectionError::Interrupted));
    }
}
