//! Splits boxes into clusters that fit a block, by the surface area heuristic.
//!
//! A ray meets a convex box in proportion to its area, and a block costs the same however full it is: at every
//! split the sum over both sides of area times blocks is least.
//!
//! Not handled: many boxes; the search tries every split along every axis, n² log n in the worst case.

use obvhs::aabb::Aabb;

/// Groups of at most `size` box numbers, each number once.
pub(crate) fn clusters(boxes: &[Aabb], size: usize) -> Vec<Vec<u32>> {
    let mut found = Vec::new();
    let mut numbers: Vec<u32> = (0..boxes.len() as u32).collect();
    split(boxes, &mut numbers, size, &mut found);
    found
}

fn split(boxes: &[Aabb], numbers: &mut [u32], size: usize, found: &mut Vec<Vec<u32>>) {
    if numbers.len() <= size {
        if !numbers.is_empty() {
            found.push(numbers.to_vec());
        }
        return;
    }
    let splits = (0..3).map(|axis| {
        sort(boxes, numbers, axis);
        let (cost, at) = cheapest(boxes, numbers, size);
        (cost, axis, at)
    });
    let best = splits.min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, axis, at) = best.expect("three axes");
    sort(boxes, numbers, axis);
    let (left, right) = numbers.split_at_mut(at);
    split(boxes, left, size, found);
    split(boxes, right, size, found);
}

/// By centre along an axis, ties by number.
fn sort(boxes: &[Aabb], numbers: &mut [u32], axis: usize) {
    let center = |n: u32| boxes[n as usize].center()[axis];
    numbers.sort_unstable_by(|&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
}

/// The least cost of a split in this order, and how many boxes are before it.
fn cheapest(boxes: &[Aabb], numbers: &[u32], size: usize) -> (f32, usize) {
    let n = numbers.len();
    let before = areas(boxes, numbers.iter());
    let after = areas(boxes, numbers.iter().rev());
    let cost = |k: usize| {
        let blocks = |k: usize| k.div_ceil(size) as f32;
        before[k - 1] * blocks(k) + after[n - k - 1] * blocks(n - k)
    };
    let costs = (1..n).map(|k| (cost(k), k));
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).expect("more than one box")
}

/// Half the area of the box around the first, the first two, and so on.
fn areas<'a>(boxes: &[Aabb], numbers: impl Iterator<Item = &'a u32>) -> Vec<f32> {
    let grown = numbers.scan(Aabb::INVALID, |grown, &n| {
        *grown = grown.union(&boxes[n as usize]);
        Some(grown.half_area())
    });
    grown.collect()
}
