//! Bounding boxes, and the box of most of some positions.

use glam::Vec3;

/// Share of all rays that a box twice as large must add. A plane up to the horizon adds less from a distance of about
/// ten times the height of the eye.
const SHARE_PER_DOUBLING: f32 = 0.05;

/// A box: lower and upper corner.
pub(super) type Bounds = (Vec3, Vec3);

/// Diagonal of a box.
pub(super) fn diagonal((low, high): Bounds) -> f32 {
    (high - low).length()
}

/// The smallest box around two boxes.
pub(super) fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// What two boxes share.
pub(super) fn intersection(a: Bounds, b: Bounds) -> Bounds {
    (a.0.max(b.0), a.1.min(b.1))
}

/// A box whose sides are multiples of a sixteenth of its size, at least as large. Cameras that see nearly the same have
/// the same box, and so the same texels and voxels.
pub(super) fn snapped(bounds: Bounds) -> Bounds {
    let step = (diagonal(bounds).max(f32::MIN_POSITIVE).log2().round() - 4.0).exp2().max(f32::MIN_POSITIVE);
    ((bounds.0 / step).floor() * step, (bounds.1 / step).ceil() * step)
}

/// The box of most of these positions. Of all boxes that remain when positions are removed from the outside, it is the
/// one that is worth its size: a box twice as large has few more. `rays` is the number of rays that looked for positions.
pub(super) fn most_of(positions: &[Vec3], rays: usize) -> Option<Bounds> {
    let mut peel = Peel::new(positions);
    let mut best: Option<(f32, Bounds)> = None;
    while 2 * peel.left > positions.len() {
        let bounds = peel.bounds();
        let removed = (positions.len() - peel.left) as f32 / rays as f32;
        let cost = diagonal(bounds).max(f32::MIN_POSITIVE).log2() + removed / SHARE_PER_DOUBLING;
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, bounds));
        }
        peel.remove_outermost();
    }
    best.map(|(_, bounds)| bounds)
}

/// Positions that are removed from the outside.
struct Peel<'a> {
    positions: &'a [Vec3],
    removed: Vec<bool>,
    left: usize,
    /// For each side (low x, high x, low y and so on) all positions from the outermost one.
    order: [Vec<u32>; 6],
    /// For each side, how many of them are passed over at least.
    first: [usize; 6],
}

impl<'a> Peel<'a> {
    fn new(positions: &'a [Vec3]) -> Self {
        let order = std::array::from_fn(|side| {
            let mut order: Vec<u32> = (0..positions.len() as u32).collect();
            let sign = if side % 2 == 0 { 1.0 } else { -1.0 };
            order.sort_by(|&a, &b| {
                let along = |i: u32| sign * positions[i as usize][side / 2];
                along(a).total_cmp(&along(b))
            });
            order
        });
        Self { positions, removed: vec![false; positions.len()], left: positions.len(), order, first: [0; 6] }
    }

    /// Those left, from the outermost one at this side.
    fn from(&self, side: usize) -> impl Iterator<Item = usize> {
        self.order[side][self.first[side]..].iter().map(|&i| i as usize).filter(|&i| !self.removed[i])
    }

    /// The box of those left.
    fn bounds(&self) -> Bounds {
        let end = |side: usize| self.from(side).next().map_or(0.0, |i| self.positions[i][side / 2]);
        (Vec3::new(end(0), end(2), end(4)), Vec3::new(end(1), end(3), end(5)))
    }

    /// Removes the positions at one side that make the box largest, for their number.
    fn remove_outermost(&mut self) {
        let (low, high) = self.bounds();
        let size = high - low;
        // Gain for each number of positions: the diagonal that removing them would save on their side alone.
        let best =
            (0..6).flat_map(|side| [1, 2, 4, 8, 16, 32].map(|count| (side, count))).filter_map(|(side, count)| {
                let axis = side / 2;
                let outer = self.positions[self.from(side).next()?][axis];
                let inner = self.positions[self.from(side).nth(count)?][axis];
                let mut smaller = size;
                smaller[axis] -= (inner - outer).abs();
                Some((side, count, (size.length() - smaller.length()) / count as f32))
            });
        let (side, count) = best
            .max_by(|a, b| a.2.total_cmp(&b.2).then(b.1.cmp(&a.1)))
            .map_or((0, 1), |(side, count, _)| (side, count));
        let outermost: Vec<usize> = self.from(side).take(count).collect();
        self.left -= outermost.len();
        for i in outermost {
            self.removed[i] = true;
        }
        for side in 0..6 {
            let passed = self.order[side][self.first[side]..].iter().take_while(|&&i| self.removed[i as usize]).count();
            self.first[side] += passed;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_far_position_does_not_count() {
        let mut positions: Vec<Vec3> = (0..100).map(|i| Vec3::new((i % 10) as f32, (i / 10) as f32, 0.0)).collect();
        let near = (Vec3::ZERO, Vec3::new(9.0, 9.0, 0.0));
        assert_eq!(most_of(&positions, 100), Some(near));
        positions.push(Vec3::new(1e4, 0.0, 0.0));
        assert_eq!(most_of(&positions, 101), Some(near));
        // Far positions that are a third of the picture count.
        positions.extend((0..50).map(|i| Vec3::new(100.0, i as f32, 0.0)));
        assert_eq!(most_of(&positions, 151), Some((Vec3::ZERO, Vec3::new(100.0, 49.0, 0.0))));
        assert_eq!(most_of(&[], 100), None);
    }

    #[test]
    fn a_snapped_box_holds_the_box() {
        for bounds in [(Vec3::ZERO, Vec3::ONE), (Vec3::splat(-3.3), Vec3::new(0.1, 7.7, -3.2)), (Vec3::ONE, Vec3::ONE)]
        {
            let (low, high) = snapped(bounds);
            assert!(low.cmple(bounds.0).all() && high.cmpge(bounds.1).all(), "{bounds:?}");
            assert!(diagonal((low, high)) <= 1.4 * diagonal(bounds) + 1e-30, "{bounds:?} {low} {high}");
        }
    }
}
