//! A tree of boxes around the triangles of a mesh: what is near a point, or near a line, is found
//! without a look at all of them.

use crate::tensor::Vec3;

/// Triangles of a leaf, at most.
const LEAF: usize = 4;

/// A box around some triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

/// A node of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Branch {
    bounds: Bounds,
    /// The first of its triangles in the order of the tree, or the number of its second child; its
    /// first child follows it
    next: u32,
    /// The number of its triangles; zero with children
    count: u32,
}

/// The tree.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tree {
    branches: Vec<Branch>,
    /// Numbers of triangles by leaves
    order: Vec<u32>,
}

impl Bounds {
    fn around(points: impl Iterator<Item = Vec3>) -> Self {
        let infinite = Vec3([f64::INFINITY; 3]);
        points.fold(Self { low: infinite, high: -infinite }, |bounds, point| bounds.with(point))
    }

    fn with(self, point: Vec3) -> Self {
        let low = std::array::from_fn(|k| self.low.0[k].min(point.0[k]));
        let high = std::array::from_fn(|k| self.high.0[k].max(point.0[k]));
        Self { low: Vec3(low), high: Vec3(high) }
    }

    /// The square of the distance of a point from the box.
    fn squared_distance(&self, y: Vec3) -> f64 {
        let beyond = |k: usize| (self.low.0[k] - y.0[k]).max(y.0[k] - self.high.0[k]).max(0.0);
        let [a, b, c] = [beyond(0), beyond(1), beyond(2)];
        a * a + b * b + c * c
    }

    fn widest(&self) -> usize {
        let size = self.high - self.low;
        (0..3).fold(0, |widest, k| if size.0[k] > size.0[widest] { k } else { widest })
    }
}

/// The distance of the point `y` from the line between two points.
pub(super) fn from_line([a, b]: [Vec3; 2], y: Vec3) -> f64 {
    let along = b - a;
    let square = along.squared();
    let part = if square > 0.0 { ((y - a).dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (y - a - along * part).norm()
}

impl Tree {
    /// The tree of triangles with these corners.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let middles: Vec<Vec3> = triangles.iter().map(|[a, b, c]| (*a + *b + *c) * (1.0 / 3.0)).collect();
        let mut tree = Self { branches: Vec::new(), order: (0..triangles.len() as u32).collect() };
        let mut order = std::mem::take(&mut tree.order);
        tree.grow(triangles, &middles, &mut order, 0);
        tree.order = order;
        tree
    }

    /// Adds the branch of the triangles `own`, the first of which is number `first` in the order.
    fn grow(&mut self, triangles: &[[Vec3; 3]], middles: &[Vec3], own: &mut [u32], first: usize) {
        let corners = own.iter().flat_map(|&t| triangles[t as usize]);
        let number = self.branches.len();
        self.branches.push(Branch { bounds: Bounds::around(corners), next: first as u32, count: own.len() as u32 });
        if own.len() <= LEAF {
            return;
        }
        let axis = Bounds::around(own.iter().map(|&t| middles[t as usize])).widest();
        let at = |t: &u32| middles[*t as usize].0[axis];
        let half = own.len() / 2;
        own.select_nth_unstable_by(half, |a, b| at(a).total_cmp(&at(b)).then(a.cmp(b)));
        let (left, right) = own.split_at_mut(half);
        self.grow(triangles, middles, left, first);
        self.branches[number].next = self.branches.len() as u32;
        self.branches[number].count = 0;
        self.grow(triangles, middles, right, first + half);
    }

    /// Offers the triangles that may be nearer to `y` than the nearest so far. `offer` gives the
    /// square of the smallest distance so far.
    pub fn nearest(&self, y: Vec3, offer: &mut dyn FnMut(u32) -> f64) {
        let mut least = f64::INFINITY;
        // Halves of halves: deeper trees have more triangles than a number can count.
        let mut waiting = [(0u32, 0.0f64); 64];
        let mut count = usize::from(!self.branches.is_empty());
        while count > 0 {
            count -= 1;
            let (number, square) = waiting[count];
            if square >= least {
                continue;
            }
            let branch = &self.branches[number as usize];
            if branch.count > 0 {
                for place in branch.next..branch.next + branch.count {
                    least = offer(self.order[place as usize]);
                }
                continue;
            }
            let children = [number + 1, branch.next];
            let [first, second] = children.map(|child| self.branches[child as usize].bounds.squared_distance(y));
            let [near, far] = if first <= second { [0, 1] } else { [1, 0] };
            let squares = [first, second];
            waiting[count] = (children[far], squares[far]);
            waiting[count + 1] = (children[near], squares[near]);
            count += 2;
        }
    }

    /// Shows all triangles that may be within `reach` of the line between two points, and some that
    /// are not.
    pub fn near_line(&self, line: [Vec3; 2], reach: f64, show: &mut dyn FnMut(u32)) {
        let mut waiting: Vec<u32> = Vec::new();
        waiting.extend((!self.branches.is_empty()).then_some(0));
        while let Some(number) = waiting.pop() {
            let branch = &self.branches[number as usize];
            let Bounds { low, high } = branch.bounds;
            if from_line(line, (low + high) * 0.5) > reach + 0.5 * (high - low).norm() {
                continue;
            }
            if branch.count == 0 {
                waiting.extend([branch.next, number + 1]);
            } else {
                (branch.next..branch.next + branch.count).for_each(|place| show(self.order[place as usize]));
            }
        }
    }
}
