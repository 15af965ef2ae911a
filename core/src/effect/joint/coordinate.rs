//! Free coordinates of joints, angle and slide, with their derivatives over u_A, P_A, u_B, P_B.

use super::{FreeCoordinate, Joint};
use crate::kernel::ElementSystem;
use crate::kernel::joint::{DirectionPair, End, GapFactors, add_along, add_between, block, cosine, slides};
use crate::system::State;
use crate::tensor::Vec3;
use std::f64::consts::PI;

/// A free coordinate of a joint in some state.
pub(super) struct Coordinate {
    /// The value of the coordinate: radians, or a length
    pub(super) value: f64,
    /// First derivatives over u_A, P_A, u_B, P_B
    pub(super) gradient: [Vec3; 4],
    /// Second derivatives, as the tangent of a system
    pub(super) hessian: ElementSystem,
}

/// The rate of a free coordinate.
pub(super) struct Rate {
    /// The rate: radians or a length over time
    pub(super) value: f64,
    /// Derivatives of the rate over the rates of the unknowns
    pub(super) over_rate: [Vec3; 4],
    /// Derivatives of the rate over the unknowns
    pub(super) over_unknown: [Vec3; 4],
}

/// An angle in radians less its whole turns, in [-pi, pi].
pub fn nearest_angle(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

impl Coordinate {
    /// Adds the forces of a multiplier on this coordinate, their tangent, and the row and column of
    /// the multiplier, which is number `row` of the block [`block::BETWEEN`].
    pub fn add_multiplier(&self, multiplier: f64, factors: GapFactors, row: usize, out: &mut ElementSystem) {
        let mut unit = Vec3::ZERO;
        unit.0[row] = factors.multiplier;
        for k in 0..4 {
            out.add_force(k, self.gradient[k] * multiplier);
            let column = self.gradient[k].outer(unit);
            out.add_tangent(k, block::BETWEEN, column);
            out.add_tangent(block::BETWEEN, k, column.transpose());
            for j in 0..4 {
                out.add_tangent(k, j, self.hessian.tangent_block(k, j).scale(multiplier * factors.forces));
            }
        }
    }
}

impl Joint {
    /// A free coordinate of the joint. An angle with a memory in the state is continued through
    /// whole turns.
    pub(super) fn coordinate(&self, which: FreeCoordinate, at: &State, ends: &[End; 2]) -> Coordinate {
        match which {
            FreeCoordinate::Slide => self.slide_of(ends),
            FreeCoordinate::Angle => {
                let before = self.angle.map_or(0.0, |number| at.angles[number]);
                let coordinate = self.angle_of(ends);
                let turns = ((before - coordinate.value) / (2.0 * PI)).round();
                Coordinate { value: coordinate.value + 2.0 * PI * turns, ..coordinate }
            }
        }
    }

    /// The slide, the displacement of B along e_1 of A.
    fn slide_of(&self, ends: &[End; 2]) -> Coordinate {
        let mut own = ElementSystem::new(block::COUNT);
        add_along(&self.axes, &self.arms, ends, Vec3::UNIT[0], GapFactors::HESSIAN, &mut own);
        Coordinate {
            value: slides(&self.axes, &self.arms, &ends[0], &ends[1]).0[0],
            gradient: [0, 1, 2, 3].map(|k| own.force_block(k)),
            hessian: own,
        }
    }

    /// The angle atan2(s, c) between e_2 of A and of B, with c = (R_A e_2).(R_B e_2), s = -(R_A
    /// e_2).(R_B e_3):
    ///
    /// ```text
    /// r^2 dx = c ds - s dc,   r^2 = c^2 + s^2
    /// r^2 d2x = c d2s - s d2c + ds dc' - dc ds' - 2 dx (c dc' + s ds')
    /// ```
    pub(super) fn angle_of(&self, ends: &[End; 2]) -> Coordinate {
        let e = |k: usize| self.axes.column(k);
        let part = |a: Vec3, b: Vec3| {
            let directions = DirectionPair { a, b };
            let mut own = ElementSystem::new(block::COUNT);
            add_between(directions, ends, 1.0, GapFactors::HESSIAN, 0, &mut own);
            (cosine(directions, &ends[0], &ends[1]), own)
        };
        let (c, dc) = part(e(1), e(1));
        let (s, ds) = part(e(1), -e(2));
        let scale = 1.0 / (c * c + s * s);
        let gradient: [Vec3; 4] = std::array::from_fn(|k| (ds.force_block(k) * c - dc.force_block(k) * s) * scale);
        let mut hessian = ElementSystem::new(block::COUNT);
        for row in 0..4 {
            for column in 0..4 {
                let straight = ds.tangent_block(row, column).scale(c) - dc.tangent_block(row, column).scale(s);
                let turning = ds.force_block(row).outer(dc.force_block(column))
                    - dc.force_block(row).outer(ds.force_block(column));
                let growth = dc.force_block(column) * c + ds.force_block(column) * s;
                let shrinking = gradient[row].outer(growth * 2.0);
                hessian.add_tangent(row, column, (straight + turning - shrinking).scale(scale));
            }
        }
        Coordinate { value: libm::atan2(s, c), gradient, hessian }
    }

    /// The rate of a free coordinate of the joint.
    pub(super) fn rate(&self, at: &State, coordinate: &Coordinate) -> Rate {
        let mut out = Rate { value: 0.0, over_rate: coordinate.gradient, over_unknown: [Vec3::ZERO; 4] };
        let mut rates = [Vec3::ZERO; 4];
        for (k, node) in self.nodes.iter().enumerate() {
            let Some(node) = node else { continue };
            let turning = at.rotation_rate(node.p);
            let row = 2 * k + 1;
            rates[2 * k] = at.v[node.u as usize];
            rates[row] = turning.rate;
            (out.over_rate[row], out.over_unknown[row]) = turning.pull_back(coordinate.gradient[row]);
        }
        for row in 0..4 {
            out.value += coordinate.gradient[row].dot(rates[row]);
            for (column, over) in out.over_unknown.iter_mut().enumerate() {
                *over += coordinate.hessian.tangent_block(row, column).transpose_mul(rates[row]);
            }
        }
        out
    }
}
