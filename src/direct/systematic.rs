//! Systematic sampling: a few of many, in proportion to what each is expected to bring.
//!
//! Not handled: how good the expectation is; it decides the variance, and no bias.

use smallvec::SmallVec;

/// What was drawn: numbers, and the weight of each with which the mean is that of all.
pub(crate) type Drawn = SmallVec<[(usize, f64); 20]>;

/// Draws about `count` of some parts, at steps of their sum over `count` from the share `offset` of one on; the weight
/// of one drawn `times` is `times / (count p)`, p its share of the sum. Parts of 0 are never drawn.
pub(crate) fn systematic(parts: impl Iterator<Item = f64> + Clone, count: usize, offset: f64) -> Drawn {
    let step = parts.clone().sum::<f64>() / count as f64;
    let (mut next, mut until) = (step * offset, 0.0);
    let mut drawn = Drawn::new();
    for (k, part) in parts.enumerate() {
        until += part;
        let times = ((until - next) / step).ceil().max(0.0);
        next += times * step;
        if times > 0.0 && part > 0.0 {
            drawn.push((k, times * step / part));
        }
    }
    drawn
}
